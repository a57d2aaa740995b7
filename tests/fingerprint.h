/* fingerprint.h - a world as numbers, by its queries: all that a caller can see of it, to compare
   bit by bit. Include it after testing.h. */
#ifndef FINGERPRINT_H
#define FINGERPRINT_H

typedef struct fingerprint_entry {
    double value;
    const char *what; /* names it; for messages */
    int of;           /* which particle, contact or wall */
} fingerprint_entry;

typedef struct fingerprint {
    fingerprint_entry *at;
    int count, room;
} fingerprint;

PART void fingerprint_free(fingerprint *f) {
    free(f->at);
    memset(f, 0, sizeof *f);
}

PART void fingerprint_put(fingerprint *f, const char *what, int of, double value) {
    if (f->count == f->room) {
        f->room = f->room > 0 ? 2 * f->room : 512;
        f->at = realloc(f->at, (size_t)f->room * sizeof *f->at);
        if (!f->at) abort();
    }
    f->at[f->count++] = (fingerprint_entry){value, what, of};
}

PART void fingerprint_put_vec(fingerprint *f, const char *what, int of, dem2d_vec v) {
    fingerprint_put(f, what, of, v.x);
    fingerprint_put(f, what, of, v.y);
}

#define FINGERPRINT_ID(f, what, of, id)                    \
    do {                                                   \
        fingerprint_put((f), what, (of), (id).index);      \
        fingerprint_put((f), what, (of), (id).generation); \
    } while (0)

PART void fingerprint_particles(fingerprint *f, const dem2d_world *world) {
    int count = -1, again = -1;
    assert_ok(dem2d_world_particles(world, NULL, 0, &count));
    dem2d_particle_id *ids = calloc((size_t)count + 1, sizeof *ids);
    assert_non_null(ids);
    assert_ok(dem2d_world_particles(world, ids, count, &again));
    assert_int_equal(count, again);
    for (int i = 0; i < count; i++) {
        dem2d_particle_info p;
        assert_ok(dem2d_world_get_particle(world, ids[i], &p));
        FINGERPRINT_ID(f, "id of particle", i, ids[i]);
        FINGERPRINT_ID(f, "shape of particle", i, p.shape);
        FINGERPRINT_ID(f, "material of particle", i, p.material);
        fingerprint_put(f, "motion of particle", i, p.motion);
        fingerprint_put_vec(f, "position of particle", i, p.pose.position);
        fingerprint_put(f, "rotation.c of particle", i, p.pose.rotation.c);
        fingerprint_put(f, "rotation.s of particle", i, p.pose.rotation.s);
        fingerprint_put(f, "scale of particle", i, p.pose.scale);
        fingerprint_put_vec(f, "velocity of particle", i, p.velocity);
        fingerprint_put(f, "angular_velocity of particle", i, p.angular_velocity);
        fingerprint_put_vec(f, "force of particle", i, p.force);
        fingerprint_put(f, "torque of particle", i, p.torque);
        fingerprint_put(f, "mass of particle", i, p.mass);
        fingerprint_put(f, "inertia of particle", i, p.inertia);
        fingerprint_put(f, "radius of particle", i, p.radius);
        fingerprint_put(f, "equivalent of particle", i, p.equivalent);
    }
    free(ids);
}

PART void fingerprint_contacts(fingerprint *f, const dem2d_world *world) {
    int count = -1, again = -1;
    assert_ok(dem2d_world_contacts(world, NULL, 0, &count));
    dem2d_contact_info *list = calloc((size_t)count + 1, sizeof *list);
    assert_non_null(list);
    assert_ok(dem2d_world_contacts(world, list, count, &again));
    assert_int_equal(count, again);
    for (int i = 0; i < count; i++) {
        const dem2d_contact_info *c = &list[i];
        FINGERPRINT_ID(f, "a of contact", i, c->a);
        FINGERPRINT_ID(f, "b of contact", i, c->b);
        FINGERPRINT_ID(f, "wall of contact", i, c->wall);
        fingerprint_put_vec(f, "normal of contact", i, c->normal);
        fingerprint_put_vec(f, "point of contact", i, c->point);
        fingerprint_put_vec(f, "branch of contact", i, c->branch);
        fingerprint_put(f, "points of contact", i, c->points);
        fingerprint_put(f, "depth of contact", i, c->depth);
        fingerprint_put(f, "normal_force of contact", i, c->normal_force);
        fingerprint_put(f, "tangential_force of contact", i, c->tangential_force);
        fingerprint_put(f, "moment of contact", i, c->moment);
    }
    free(list);
}

PART void fingerprint_wall(fingerprint *f, const dem2d_world *world, dem2d_wall_id id,
                                  int i) {
    dem2d_wall_info w;
    assert_ok(dem2d_world_get_wall(world, id, &w));
    fingerprint_put(f, "mode of wall", i, w.mode);
    FINGERPRINT_ID(f, "material of wall", i, w.material);
    fingerprint_put_vec(f, "point of wall", i, w.point);
    fingerprint_put_vec(f, "normal of wall", i, w.normal);
    fingerprint_put(f, "segment of wall", i, w.segment);
    fingerprint_put_vec(f, "end of wall", i, w.end);
    fingerprint_put_vec(f, "velocity of wall", i, w.velocity);
    fingerprint_put_vec(f, "force of wall", i, w.force);
    fingerprint_put(f, "length of wall", i, w.length);
    fingerprint_put(f, "stress of wall", i, w.stress);
    fingerprint_put(f, "target of wall", i, w.target);
}

PART void fingerprint_measures(fingerprint *f, const dem2d_world *world) {
    dem2d_energy e;
    dem2d_stress s;
    dem2d_packing p;
    dem2d_particle_id worst;
    double safe, limit;
    assert_ok(dem2d_world_energy(world, &e));
    assert_ok(dem2d_world_stress(world, 1, &s));
    assert_ok(dem2d_world_packing(world, &p));
    assert_ok(dem2d_world_time_step_bounds(world, &safe, &limit, &worst));
    const double numbers[] = {e.translational,
                              e.rotational,
                              e.normal,
                              e.tangential,
                              e.rolling,
                              e.potential,
                              s.xx,
                              s.xy,
                              s.yx,
                              s.yy,
                              p.coordination,
                              p.mean_overlap,
                              p.max_overlap,
                              p.solid_area,
                              safe,
                              limit,
                              worst.index,
                              worst.generation};
    for (int i = 0; i < COUNT_OF(numbers); i++) fingerprint_put(f, "measure", i, numbers[i]);
    fingerprint_put(f, "coordination_loaded", 0, p.coordination_loaded);
    fingerprint_put(f, "rattlers", 0, p.rattlers);
}

/* Of a world that keeps one. */
PART void fingerprint_ledger(fingerprint *f, const dem2d_world *world) {
    dem2d_ledger l;
    if (dem2d_world_ledger(world, &l) != DEM2D_OK) return;
    const double numbers[] = {l.kinetic,  l.normal,  l.tangential, l.gravity, l.walls,  l.driven,
                              l.friction, l.dashpot, l.damping,    l.given,   l.closure};
    for (int i = 0; i < COUNT_OF(numbers); i++) fingerprint_put(f, "ledger", i, numbers[i]);
}

/* All counters but the bytes in use: arrays may have grown for what then failed. */
PART void fingerprint_stats(fingerprint *f, const dem2d_world *world) {
    dem2d_stats s;
    assert_ok(dem2d_world_stats(world, &s));
    const double numbers[] = {(double)s.steps,
                              (double)s.list_rebuilds,
                              (double)s.support_calls,
                              (double)s.collisions,
                              (double)s.separations,
                              (double)s.not_converged,
                              s.particles,
                              (double)s.slow_time_step,
                              (double)s.fast_motion,
                              s.walls,
                              s.pairs,
                              s.contacts,
                              s.wall_contacts,
                              s.skin};
    for (int i = 0; i < COUNT_OF(numbers); i++) fingerprint_put(f, "counter", i, numbers[i]);
    for (int i = 0; i < DEM2D_PROOF_COUNT; i++)
        fingerprint_put(f, "proofs", i, (double)s.proofs[i]);
}

/* FNV-1a */
PART bool fingerprint_hash(void *user, const char *bytes, size_t count) {
    uint64_t *hash = user;
    for (size_t i = 0; i < count; i++) *hash = (*hash ^ (unsigned char)bytes[i]) * 0x100000001b3u;
    return true;
}

/* The picture shows the outlines of the templates. */
PART void fingerprint_picture(fingerprint *f, const dem2d_world *world) {
    uint64_t hash = 0xcbf29ce484222325u;
    dem2d_svg_desc svg = {0};
    svg.write = fingerprint_hash, svg.user = &hash;
    svg.force_chains = true, svg.outline_points = 7;
    assert_ok(dem2d_world_write_svg(world, &svg, NULL));
    fingerprint_put(f, "picture", 0, (double)(hash >> 32));
    fingerprint_put(f, "picture", 1, (double)(hash & 0xffffffffu));
}

/* Of a world and those of its walls that are named. Free it when it is done with. */
PART fingerprint fingerprint_take(const dem2d_world *world, const dem2d_wall_id *walls,
                                         int count) {
    fingerprint f = {NULL, 0, 0};
    fingerprint_particles(&f, world);
    fingerprint_contacts(&f, world);
    for (int i = 0; i < count; i++) fingerprint_wall(&f, world, walls[i], i);
    fingerprint_measures(&f, world);
    fingerprint_stats(&f, world);
    fingerprint_ledger(&f, world);
    fingerprint_picture(&f, world);
    const uint64_t hash = dem2d_world_hash(world);
    fingerprint_put(&f, "hash", 0, (double)(hash >> 32));
    fingerprint_put(&f, "hash", 1, (double)(hash & 0xffffffffu));
    return f;
}

/* The same bits; says what differs first. */
PART bool fingerprint_same(const fingerprint *a, const fingerprint *b) {
    const int count = a->count < b->count ? a->count : b->count;
    for (int i = 0; i < count; i++) {
        const fingerprint_entry *x = &a->at[i], *y = &b->at[i];
        if (memcmp(&x->value, &y->value, sizeof x->value) == 0) continue;
        print_error("%s %d: %.17g, was %.17g\n", x->what, x->of, y->value, x->value);
        return false;
    }
    if (a->count == b->count) return true;
    print_error("%d numbers instead of %d\n", b->count, a->count);
    return false;
}

#endif
