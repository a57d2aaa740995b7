/* world_scene.h - small worlds for tests, campaigns and benchmarks: a world with one material, how
   grains and walls get into it, and what is asked of it. C99 and C++11. Include it after dem2d.h.
 */
#ifndef WORLD_SCENE_H
#define WORLD_SCENE_H

#include "parts.h"

#include <math.h>
#include <stdbool.h>

typedef struct scene {
    dem2d_world *world;
    dem2d_material_id material;
} scene;

/* --- building --------------------------------------------------------------------------------- */

/* 2700 kg/m2, 1e7 N/m. */
PART dem2d_material_desc stone_desc(double tangential_stiffness, double friction) {
    return material_desc(2700, 1e7, tangential_stiffness, friction);
}

PART scene open_scene(const dem2d_world_desc *desc, const dem2d_material_desc *material) {
    scene s;
    memset(&s, 0, sizeof s);
    expect_ok(dem2d_world_create(desc, &s.world), "world");
    expect_ok(dem2d_world_add_material(s.world, material, &s.material), "material");
    return s;
}

PART void close_scene(const scene *s) {
    dem2d_world_destroy(s->world);
}

PART dem2d_shape_id copy_shape(const scene *s, const dem2d_shape *shape) {
    dem2d_shape_id id;
    expect_ok(dem2d_world_add_shape(s->world, shape, &id), "template");
    return id;
}

/* The same of a template that is given away. */
PART dem2d_shape_id give_shape(const scene *s, dem2d_shape *shape) {
    const dem2d_shape_id id = copy_shape(s, shape);
    dem2d_shape_destroy(shape);
    return id;
}

/* A free grain at rest. */
PART dem2d_particle_desc grain_desc(const scene *s, dem2d_shape_id shape, double scale,
                                    dem2d_vec at) {
    dem2d_particle_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.scale = scale, desc.shape = shape, desc.material = s->material, desc.position = at;
    return desc;
}

PART dem2d_particle_id add_grain(const scene *s, const dem2d_particle_desc *desc) {
    dem2d_particle_id id;
    expect_ok(dem2d_world_add_particle(s->world, desc, &id), "grain");
    return id;
}

/* A grain with a template of its own. */
PART dem2d_particle_id add_copy(const scene *s, const dem2d_shape *shape, dem2d_motion motion,
                                dem2d_vec at, double angle, dem2d_vec velocity, double spin) {
    dem2d_particle_desc desc = grain_desc(s, copy_shape(s, shape), 1, at);
    desc.motion = motion, desc.angle = angle;
    desc.velocity = velocity, desc.angular_velocity = spin;
    return add_grain(s, &desc);
}

/* The same of a template that is given away. */
PART dem2d_particle_id add_shape(const scene *s, dem2d_shape *shape, dem2d_motion motion,
                                 dem2d_vec at, double angle, dem2d_vec velocity, double spin) {
    const dem2d_particle_id id = add_copy(s, shape, motion, at, angle, velocity, spin);
    dem2d_shape_destroy(shape);
    return id;
}

/* A half-plane that stands still. */
PART dem2d_wall_desc plane_desc(const scene *s, dem2d_vec point, dem2d_vec normal) {
    dem2d_wall_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.material = s->material, desc.point = point, desc.normal = normal;
    return desc;
}

PART dem2d_wall_id add_wall(const scene *s, const dem2d_wall_desc *desc) {
    dem2d_wall_id id;
    expect_ok(dem2d_world_add_wall(s->world, desc, &id), "wall");
    return id;
}

PART dem2d_wall_id add_plane(const scene *s, double x, double y, double nx, double ny) {
    const dem2d_wall_desc desc = plane_desc(s, vec(x, y), vec(nx, ny));
    return add_wall(s, &desc);
}

PART dem2d_wall_id add_floor(const scene *s) {
    return add_plane(s, 0, 0, 0, 1);
}

PART dem2d_wall_id add_segment(const scene *s, dem2d_vec from, dem2d_vec to) {
    dem2d_wall_desc desc = plane_desc(s, from, vec(0, 0));
    desc.segment = true, desc.end = to;
    return add_wall(s, &desc);
}

/* --- running and asking ----------------------------------------------------------------------- */

PART void step(const scene *s, int count) {
    expect_ok(dem2d_world_step(s->world, count, NULL), "step");
}

PART dem2d_particle_info grain_of(const scene *s, dem2d_particle_id id) {
    dem2d_particle_info info;
    expect_ok(dem2d_world_get_particle(s->world, id, &info), "grain");
    return info;
}

/* In (-pi, pi]. */
PART double angle_of(const scene *s, dem2d_particle_id id) {
    return dem2d_rot_angle(grain_of(s, id).pose.rotation);
}

PART dem2d_wall_info wall_of(const scene *s, dem2d_wall_id id) {
    dem2d_wall_info info;
    expect_ok(dem2d_world_get_wall(s->world, id, &info), "wall");
    return info;
}

/* How many contacts there are; up to `room` of them into list. */
PART int contacts_of(const scene *s, dem2d_contact_info *list, int room) {
    int count;
    expect_ok(dem2d_world_contacts(s->world, list, room, &count), "contacts");
    return count;
}

PART dem2d_energy energy_of(const scene *s) {
    dem2d_energy energy;
    expect_ok(dem2d_world_energy(s->world, &energy), "energy");
    return energy;
}

PART double kinetic_of(const scene *s) {
    const dem2d_energy e = energy_of(s);
    return e.translational + e.rotational;
}

PART dem2d_ledger ledger_of(const scene *s) {
    dem2d_ledger ledger;
    expect_ok(dem2d_world_ledger(s->world, &ledger), "ledger");
    return ledger;
}

PART dem2d_stats stats_of(const scene *s) {
    dem2d_stats stats;
    expect_ok(dem2d_world_stats(s->world, &stats), "stats");
    return stats;
}

PART dem2d_packing packing_of(const scene *s) {
    dem2d_packing packing;
    expect_ok(dem2d_world_packing(s->world, &packing), "packing");
    return packing;
}

PART void set_velocity(const scene *s, dem2d_particle_id id, dem2d_motion motion,
                       dem2d_vec velocity, double spin) {
    expect_ok(dem2d_world_drive_particle(s->world, id, motion, velocity, spin), "velocity");
}

/* --- snapshots in memory ---------------------------------------------------------------------- */

typedef struct scene_bytes {
    char *bytes;
    size_t size, room;
    size_t next;  /* for reading */
    size_t limit; /* of writing or reading, from which on it fails; 0: none */
} scene_bytes;

PART bool scene_write(void *user, const char *bytes, size_t count) {
    scene_bytes *to = (scene_bytes *)user;
    if (to->limit > 0 && to->size + count >= to->limit) return false;
    if (to->size + count > to->room) {
        to->room = 2 * (to->size + count);
        to->bytes = (char *)realloc(to->bytes, to->room);
        if (to->bytes == NULL) abort();
    }
    memcpy(to->bytes + to->size, bytes, count);
    to->size += count;
    return true;
}

PART bool scene_read(void *user, char *bytes, size_t count) {
    scene_bytes *from = (scene_bytes *)user;
    if (count > from->size - from->next) return false;
    if (from->limit > 0 && from->next + count >= from->limit) return false;
    memcpy(bytes, from->bytes + from->next, count);
    from->next += count;
    return true;
}

/* The caller frees the bytes. */
PART scene_bytes scene_save(const dem2d_world *world) {
    scene_bytes bytes;
    dem2d_save_desc desc;
    memset(&bytes, 0, sizeof bytes);
    memset(&desc, 0, sizeof desc);
    desc.write = scene_write, desc.user = &bytes;
    expect_ok(dem2d_world_save(world, &desc, NULL), "save");
    return bytes;
}

/* Another world like one that was saved, without custom shapes and laws of a caller; ids hold in
   both. */
PART scene scene_load(const scene *like, scene_bytes *bytes) {
    scene s = *like;
    dem2d_load_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.read = scene_read, desc.user = bytes, bytes->next = 0;
    expect_ok(dem2d_world_load(&desc, NULL, &s.world), "load");
    return s;
}

#endif
