/* Walls that turn, belts and chains: closed forms in the turning frame, whole turns, forces on
   parts, the ledger, lists, snapshots, and what is refused; walls with one side. */
#include "dem2d.h"
#include "testing.h"
#include "world_scene.h"

#define KN 1e7

static scene make_scene(double friction, double dt, dem2d_vec gravity, bool ledger) {
    const dem2d_material_desc material = stone_desc(KN / 2, friction);
    dem2d_world_desc desc = {0};
    desc.time_step = dt, desc.gravity = gravity, desc.ledger = ledger;
    return open_scene(&desc, &material);
}

/* A regular polygon, counter-clockwise: its normals point inwards. */
static void ring_points(dem2d_vec *points, int count, double radius) {
    for (int i = 0; i < count; i++) {
        const double angle = 2 * TEST_PI * i / count;
        points[i] = vec(radius * cos(angle), radius * sin(angle));
    }
}

static dem2d_wall_desc chain_desc(const scene *s, const dem2d_vec *points, int count, bool closed) {
    dem2d_wall_desc desc = {0};
    desc.material = s->material, desc.points = points, desc.count = count, desc.closed = closed;
    return desc;
}

static dem2d_wall_part_info part_of(const scene *s, dem2d_wall_id id, int part) {
    dem2d_wall_part_info info;
    assert_ok(dem2d_world_get_wall_part(s->world, id, part, &info));
    return info;
}

enum { PLANE, SEGMENT, CHAIN, KINDS };

/* The line y = offset through the pivot at 0, as it is at angle 0; normal up. */
static dem2d_wall_id add_line(const scene *s, int kind, double offset, double spin) {
    const dem2d_vec points[3] = {{-9, offset}, {-0.01, offset}, {9, offset}};
    dem2d_wall_desc desc = chain_desc(s, kind == CHAIN ? points : NULL, kind == CHAIN ? 3 : 0, 0);
    desc.mode = DEM2D_WALL_MOVING, desc.angular_velocity = spin;
    desc.point = points[0], desc.end = points[2], desc.normal = vec(0, 2);
    desc.segment = kind == SEGMENT;
    return add_wall(s, &desc);
}

/* At rest in the turning frame: the wall presses with m w^2 r on a disc that sticks to it. Leapfrog
   goes around with an acceleration of 2 (1 - cos w dt)/dt^2 times r and a speed of
   2 sin(w dt/2)/dt times r. */
static void test_turning_frame(void **state) {
    (void)state;
    const double radius = 0.05, drum = 1, dt = 1e-5, mass = 2700 * TEST_PI * radius * radius;
    for (int kind = 0; kind < KINDS; kind++) {
        scene s = make_scene(0.5, dt, vec(0, 0), false);
        const double spin = kind == SEGMENT ? -4 : 4, turn = spin * dt;
        const double pull = mass * 2 * (1 - cos(turn)) / (dt * dt); /* over the radius */
        const double deep = pull * (drum - radius) / (KN - pull), at = drum - radius + deep;
        const dem2d_wall_id wall = add_line(&s, kind, -drum, spin);
        const double speed = 2 * sin(turn / 2) / dt * at;
        const dem2d_particle_id disc =
            add_shape(&s, make_disc(radius), DEM2D_FREE, vec(0, -at), 0,
                      vec(speed * cos(turn / 2), -speed * sin(turn / 2)), spin);
        step(&s, 200000);
        const dem2d_wall_info info = wall_of(&s, wall);
        const dem2d_particle_info d = grain_of(&s, disc);
        const double angle = atan2(d.pose.position.x, -d.pose.position.y);
        assert_near(hypot(info.force.x, info.force.y), pull * at, 1e-6);
        assert_near(hypot(info.force.x, info.force.y), mass * spin * spin * (drum - radius), 1e-3);
        assert_near(hypot(d.pose.position.x, d.pose.position.y), at, 1e-9);
        assert_within(sin(angle - info.angle), 0, 1e-6);
        assert_near(d.angular_velocity, spin, 1e-6);
        assert_within(info.torque, 0, 1e-6 * mass);
        close_scene(&s);
    }
}

/* A disc slides without friction outwards along a turning wall: r = r0 cosh w t, and the wall
   presses with 2 m w r' (Coriolis). The torque on the wall is -r times that. */
static void test_coriolis(void **state) {
    (void)state;
    const double radius = 0.05, spin = 2, from = 0.3, dt = 1e-5;
    const double mass = 2700 * TEST_PI * radius * radius;
    for (int kind = 0; kind < KINDS; kind++) {
        scene s = make_scene(0, dt, vec(0, 0), true);
        const dem2d_wall_id wall = add_line(&s, kind, -radius, spin);
        const dem2d_particle_id disc =
            add_shape(&s, make_disc(radius), DEM2D_FREE, vec(from, 0), 0, vec(0, spin * from), 0);
        double mean = 0;
        step(&s, 99000);
        for (int i = 0; i < 2000; i++) { /* it rests on a spring: mean over its swings */
            step(&s, 1);
            const dem2d_wall_info info = wall_of(&s, wall);
            mean += hypot(info.force.x, info.force.y) / 2000;
        }
        const double time = 100000 * dt, at = from * cosh(spin * 101000 * dt);
        const dem2d_wall_info info = wall_of(&s, wall);
        const dem2d_particle_info d = grain_of(&s, disc);
        const dem2d_ledger l = ledger_of(&s);
        assert_near(mean, 2 * mass * spin * from * spin * sinh(spin * time), 3e-3);
        assert_near(info.torque, -hypot(info.force.x, info.force.y) * at, 1e-3);
        assert_near(hypot(d.pose.position.x, d.pose.position.y), at, 1e-3);
        assert_near(l.walls, l.kinetic - mass * spin * spin * from * from / 2, 3e-3);
        assert_within(l.closure, 0, 1e-5 * l.turnover);
        close_scene(&s);
    }
}

/* After whole turns all is where it was, however many: nothing of the shape is lost. */
static void test_whole_turns(void **state) {
    (void)state;
    dem2d_vec points[7];
    scene s = make_scene(0.5, 1e-3, vec(0, 0), false);
    ring_points(points, 7, 2);
    dem2d_wall_desc desc = chain_desc(&s, points, 7, true);
    desc.mode = DEM2D_WALL_MOVING, desc.pivot = vec(0.3, -0.4);
    desc.angular_velocity = -2 * TEST_PI / (16 * 1e-3);
    const dem2d_wall_id wall = add_wall(&s, &desc);
    step(&s, 16 * 20000);
    assert_within(wall_of(&s, wall).angle, 0, 1e-9); /* w dt is rounded: 20,000 times 1e-16 of it */
    for (int k = 0; k < 7; k++) {
        const dem2d_wall_part_info part = part_of(&s, wall, k);
        assert_within(part.point.x, points[k].x, 1e-9);
        assert_within(part.point.y, points[k].y, 1e-9);
        assert_near(part.length, hypot(points[1].x - points[0].x, points[1].y - points[0].y),
                    1e-15);
        assert_near(hypot(part.point.x - 0.3, part.point.y + 0.4),
                    hypot(points[k].x - 0.3, points[k].y + 0.4), 1e-15);
    }
    step(&s, 8); /* half a turn: w dt is -2 pi/16 to rounding */
    assert_near(fabs(wall_of(&s, wall).angle), TEST_PI, 1e-9);
    assert_within(part_of(&s, wall, 0).point.x, 0.6 - points[0].x, 1e-8);
    close_scene(&s);
}

/* A box on a belt slides at first, v = mu g t, then rides. What the belt does is twice what the box
   gets: as much goes into friction. */
static void test_belt(void **state) {
    (void)state;
    for (int kind = 0; kind < KINDS; kind++)
        for (int way = -1; way <= 1; way += 2) {
            const dem2d_vec points[3] = {{-1, 0}, {0.31, 0}, {9, 0}};
            const double belt = 0.5 * way, mu = 0.2, weight = 2700 * 0.02 * 9.81;
            scene s = make_scene(mu, 1e-5, vec(0, -9.81), true);
            dem2d_wall_desc desc =
                chain_desc(&s, kind == CHAIN ? points : NULL, kind == CHAIN ? 3 : 0, false);
            desc.surface_speed = belt, desc.normal = vec(0, 1), desc.point = vec(-2, 0);
            desc.end = vec(9, 0), desc.segment = kind == SEGMENT;
            const dem2d_wall_id wall = add_wall(&s, &desc);
            const dem2d_particle_id box =
                add_shape(&s, make_box(0.2, 0.1), DEM2D_FREE, vec(0.4, 0.05 - weight / (2 * KN)), 0,
                          vec(0, 0), 0);
            step(&s, 10000);
            assert_near(grain_of(&s, box).velocity.x, mu * 9.81 * 0.1 * way, 5e-3);
            assert_near(wall_of(&s, wall).force.x, -mu * weight * way, 0.1); /* the box rocks */
            step(&s, 30000);
            assert_near(grain_of(&s, box).velocity.x, belt, 1.2e-2); /* on its spring */
            const dem2d_ledger l = ledger_of(&s);
            assert_near(l.walls, 2700 * 0.02 * belt * belt, 2e-2);
            assert_near(l.friction, 2700 * 0.02 * belt * belt / 2, 2e-2);
            assert_within(l.closure, 0, 1e-3 * l.turnover);
            assert_within(wall_of(&s, wall).point.x, kind == CHAIN ? -1 : -2, 0);
            close_scene(&s);
        }
}

static scene make_drum(int parts, double spin, double skin, dem2d_wall_id *wall) {
    const dem2d_material_desc material = stone_desc(KN / 2, 0.5);
    dem2d_world_desc world = {0};
    world.time_step = 2e-5, world.gravity = vec(0, -9.81), world.ledger = true, world.skin = skin;
    scene s = open_scene(&world, &material);
    dem2d_vec points[100];
    ring_points(points, parts, 0.5);
    dem2d_wall_desc desc = chain_desc(&s, points, parts, true);
    desc.mode = DEM2D_WALL_MOVING, desc.angular_velocity = spin;
    *wall = add_wall(&s, &desc);
    memset(points, 255, sizeof points); /* they have been copied */
    for (int i = 0; i < 20; i++)
        add_shape(&s, i % 2 ? make_disc(0.04) : make_ellipse(0.05, 0.03), DEM2D_FREE,
                  vec(0.11 * (i % 5 - 2), 0.11 * (double)(i / 5) - 0.25), i, vec(0, 0), 0);
    return s;
}

/* In a drum: forces on parts add up to the wall's, energy is kept, no grain is lost; another skin
   and a snapshot give the same bits. */
static void test_drum(void **state) {
    (void)state;
    dem2d_wall_id wall, other_wall;
    scene s = make_drum(24, 3, 0, &wall), other = make_drum(24, 3, 0.4, &other_wall);
    step(&s, 10000), step(&other, 10000);
    assert_int_equal(dem2d_world_hash(s.world), dem2d_world_hash(other.world));
    scene_bytes bytes = scene_save(s.world);
    scene copy = scene_load(&s, &bytes);
    assert_int_equal(dem2d_world_hash(s.world), dem2d_world_hash(copy.world));
    double pressed = 0;
    for (int round = 0; round < 40; round++) {
        const dem2d_wall_info info = wall_of(&s, wall);
        pressed += info.stress;
        dem2d_vec force = vec(0, 0);
        double torque = 0, stress = 0;
        for (int k = 0; k < 24; k++) {
            const dem2d_wall_part_info part = part_of(&s, wall, k);
            force.x += part.force.x, force.y += part.force.y, torque += part.torque;
            stress += part.stress * part.length / info.length;
        }
        assert_within(force.x, info.force.x, 1e-9 * fabs(info.force.y));
        assert_near(force.y, info.force.y, 1e-9);
        assert_near(torque, info.torque, 1e-9);
        assert_near(stress, info.stress, 1e-9);
        assert_true(info.parts == 24 && info.segment);
        step(&s, 1000), step(&other, 1000), step(&copy, 1000);
        assert_int_equal(dem2d_world_hash(s.world), dem2d_world_hash(other.world));
        assert_int_equal(dem2d_world_hash(s.world), dem2d_world_hash(copy.world));
    }
    const dem2d_ledger l = ledger_of(&s);
    assert_within(l.closure, 0, 2e-3 * l.turnover);
    assert_true(l.walls > 0 && l.friction > 0 && pressed > 0);
    for (int i = 0; i < 20; i++) {
        const dem2d_particle_info grain = grain_of(&s, (dem2d_particle_id){(uint32_t)i, 1});
        assert_between(hypot(grain.pose.position.x, grain.pose.position.y), 0, 0.5);
    }
    free(bytes.bytes);
    close_scene(&s), close_scene(&other), close_scene(&copy);
}

/* A new velocity and spin keep list, contacts and history; a wall at rest can be set turning. */
static void test_drive(void **state) {
    (void)state;
    for (int kind = 0; kind < KINDS; kind++) {
        scene s = make_scene(0.5, 1e-5, vec(0, -9.81), true);
        const dem2d_wall_id wall = add_line(&s, kind, 0, 0);
        const dem2d_particle_id box =
            add_shape(&s, make_box(0.2, 0.1), DEM2D_FREE,
                      vec(0.4, 0.05 - 2700 * 0.02 * 9.81 / (2 * KN)), 0, vec(0, 0), 0);
        step(&s, 20000);
        const dem2d_stats before = stats_of(&s);
        dem2d_contact_info contact, after;
        assert_int_equal(contacts_of(&s, &contact, 1), 1);
        assert_ok(dem2d_world_drive_wall(s.world, wall, vec(0, 0), 1e-3));
        assert_int_equal(contacts_of(&s, &after, 1), 1);
        assert_near(after.normal_force, contact.normal_force, 1e-15);
        step(&s, 100);
        assert_int_equal(stats_of(&s).list_rebuilds, before.list_rebuilds);
        step(&s, 100000 - 100); /* tilts by 1e-3 in a second: the box sticks */
        const dem2d_wall_info info = wall_of(&s, wall);
        assert_near(info.angle, 1e-3, 1e-9);
        assert_near(info.normal.x, -sin(1e-3), 1e-9);
        assert_near(angle_of(&s, box), 1e-3, 2e-2);
        assert_near(info.torque, -2700 * 0.02 * 9.81 * 0.4, 0.05); /* the box rocks */
        assert_ok(dem2d_world_drive_wall(s.world, wall, vec(0.1, 0), 0));
        step(&s, 1000);
        assert_near(wall_of(&s, wall).pivot.x, 1e-3, 1e-9);
        assert_near(wall_of(&s, wall).angle, 1e-3, 1e-9);
        close_scene(&s);
    }
}

/* The far end of a blade comes fast to a disc that is far from where the blade was. */
static void test_blade(void **state) {
    (void)state;
    uint64_t hash[2];
    for (int round = 0; round < 2; round++) {
        const dem2d_material_desc material = stone_desc(KN / 2, 0.5);
        dem2d_world_desc world = {0};
        world.time_step = 1e-5, world.skin = round * 0.3;
        scene s = open_scene(&world, &material);
        dem2d_wall_desc blade = {0};
        blade.material = s.material, blade.segment = true, blade.mode = DEM2D_WALL_MOVING;
        blade.point = vec(-0.1, 0), blade.end = vec(3, 0), blade.angular_velocity = 5;
        add_wall(&s, &blade);
        const dem2d_particle_id disc =
            add_shape(&s, make_disc(0.05), DEM2D_FREE, vec(-2.5, 0), 0, vec(0, 0), 0);
        step(&s, 63000); /* half a turn and more */
        const dem2d_vec v = grain_of(&s, disc).velocity;
        assert_near(hypot(v.x, v.y), 2 * 5 * 2.5, 2e-2); /* twice the speed of the blade */
        hash[round] = dem2d_world_hash(s.world);
        close_scene(&s);
    }
    assert_int_equal(hash[0], hash[1]);
}

typedef struct refusal {
    dem2d_vec points[5];
    int count;
    bool closed;
    int index;
    const char *word;
} refusal;

/* Each text names the point; nothing has changed. */
static void test_refusals(void **state) {
    (void)state;
    static const refusal rows[] = {
        {{{0, 0}}, 1, false, -1, "count"},
        {{{0, 0}, {1, 0}}, 2, true, -1, "count"},
        {{{0, 0}, {1, 0}, {(double)NAN, 1}}, 3, false, 2, "points[2]"},
        {{{0, 0}, {1, 0}, {1, 0}, {2, 1}}, 4, false, 1, "points[1]"},
        {{{0, 0}, {1, 0}, {0.5, 0}}, 3, false, 1, "straight back"},
        {{{0, 0}, {1, 0}, {1, 1}, {0, 0}}, 4, true, 3, "leave it out"},
        {{{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, -1}}, 5, false, 0, "cross"},
        {{{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 0}}, 5, false, 0, "cross"}, /* touches */
        {{{0, 0}, {1, 0}, {1, 1}, {0, 0}}, 4, false, 0, "cross"},
        {{{0, 0}, {1, 1}, {1, 0}, {0, 1}}, 4, true, 0, "cross"},
        {{{0, 0}, {1, 0}, {2, 0}}, 3, true, 2, "straight back"},
    };
    test_env env;
    test_env_init(&env);
    dem2d_world_desc desc = {0};
    desc.time_step = 1e-5, desc.env = &env.env;
    const dem2d_material_desc material = stone_desc(KN, 0);
    scene s = open_scene(&desc, &material);
    const dem2d_wall_id floor = add_floor(&s);
    const uint64_t hash = dem2d_world_hash(s.world);
    dem2d_wall_id id;
    for (int i = 0; i < COUNT_OF(rows); i++) {
        const refusal *r = &rows[i];
        dem2d_wall_desc chain = chain_desc(&s, r->points, r->count, r->closed);
        const dem2d_result expected = i == 2 ? DEM2D_NOT_FINITE : DEM2D_OUT_OF_RANGE;
        for (int set = 0; set < 2; set++) {
            test_log_clear(&env);
            assert_result(set ? dem2d_world_set_wall(s.world, floor, &chain)
                              : dem2d_world_add_wall(s.world, &chain, &id),
                          expected);
            assert_logged(&env, expected, r->index, r->word);
            assert_int_equal(dem2d_world_hash(s.world), hash);
        }
    }
    dem2d_wall_desc servo = plane_desc(&s, vec(0, 1), vec(0, -1));
    servo.mode = DEM2D_WALL_SERVO, servo.max_speed = servo.length = 1;
    const dem2d_wall_id lid = add_wall(&s, &servo);
    servo.angular_velocity = 1;
    assert_result(dem2d_world_add_wall(s.world, &servo, &id), DEM2D_OUT_OF_RANGE);
    servo.angular_velocity = 0, servo.points = rows[2].points, servo.count = 2;
    assert_result(dem2d_world_add_wall(s.world, &servo, &id), DEM2D_OUT_OF_RANGE);
    assert_result(dem2d_world_drive_wall(s.world, lid, vec(0, 0), 0), DEM2D_OUT_OF_RANGE);
    servo.points = NULL, servo.mode = DEM2D_WALL_STILL;
    assert_result(dem2d_world_add_wall(s.world, &servo, &id), DEM2D_NULL_ARGUMENT);
    close_scene(&s);
    assert_clean(&env);
}

/* Any desc may follow any other: the same as of a world that begins with it. */
static void test_set_again(void **state) {
    (void)state;
    enum { PLAIN, TURNING, RING, TURNING_RING, STICK, COUNT };
    dem2d_vec points[6];
    ring_points(points, 6, 1);
    for (int from = 0; from < COUNT; from++)
        for (int to = 0; to < COUNT; to++) {
            dem2d_vec at[2], v[2];
            for (int fresh = 0; fresh < 2; fresh++) {
                scene s = make_scene(0.3, 1e-5, vec(0, -9.81), false);
                dem2d_wall_id first, wall;
                for (int k = fresh; k < 2; k++) {
                    const int kind = k == 0 ? from : to;
                    const bool ring = kind == RING || kind == TURNING_RING;
                    dem2d_wall_desc d = chain_desc(&s, ring ? points : NULL, ring ? 6 : 0, ring);
                    d.point = vec(-2, -0.8), d.end = vec(2, -0.8), d.normal = vec(0, 1);
                    d.segment = kind == STICK;
                    d.mode = kind == TURNING || kind == TURNING_RING ? DEM2D_WALL_MOVING
                                                                     : DEM2D_WALL_STILL;
                    d.angular_velocity = 0.5;
                    if (k == fresh) {
                        first = add_wall(&s, &d);
                        wall = add_plane(&s, -5, 0, 1, 0); /* behind it, in the order of parts */
                        add_shape(&s, make_disc(0.1), DEM2D_FREE, vec(-4.91, 0), 0, vec(-1, 0), 0);
                    } else {
                        step(&s, 10);
                        assert_ok(dem2d_world_set_wall(s.world, first, &d));
                    }
                }
                const dem2d_particle_id disc =
                    add_shape(&s, make_disc(0.1), DEM2D_FREE, vec(0.1, -0.6), 0, vec(0, -1), 0);
                step(&s, 30000);
                at[fresh] = grain_of(&s, disc).pose.position;
                v[fresh] = grain_of(&s, disc).velocity;
                assert_ok(dem2d_world_remove_wall(s.world, first));
                step(&s, 10);
                assert_int_equal(wall_of(&s, wall).parts, 1);
                close_scene(&s);
            }
            assert_same_bits(at[0].x, at[1].x);
            assert_same_bits(at[0].y, at[1].y);
            assert_same_bits(v[0].x, v[1].x);
        }
}

/* --- one side ---------------------------------------------------------------------------------- */

enum { SIDED_DISC, SIDED_BOX, SIDED_SERIES, SIDED_KINDS };

static dem2d_shape *make_sided(int kind) {
    const double a[4] = {0.1, 0, 0, 0.004}, b[4] = {0};
    if (kind == SIDED_SERIES) return make_series(a, b, 3);
    return kind == SIDED_DISC ? make_disc(0.05) : make_box(0.1, 0.1);
}

/* A floor with kinks of both kinds and two segments in line; its left is above. */
static const dem2d_vec floor_points[6] = {{-2, 0.5}, {-0.6, 0},  {-0.3, 0},
                                          {0, 0},    {0.5, 0.1}, {2, 0}};

static dem2d_wall_desc floor_chain(const scene *s, bool one_sided) {
    dem2d_wall_desc desc = chain_desc(s, floor_points, 6, false);
    desc.one_sided = one_sided;
    return desc;
}

/* From the left all is as with two sides, bit by bit. */
static void test_front_is_the_same(void **state) {
    (void)state;
    for (int kind = 0; kind < SIDED_KINDS; kind++) {
        dem2d_particle_info last[2][3];
        for (int one = 0; one < 2; one++) {
            int contacts = 0;
            scene s = make_scene(0.3, 1e-5, vec(0, -9.81), true);
            const dem2d_wall_desc desc = floor_chain(&s, one);
            dem2d_particle_id ids[3];
            add_wall(&s, &desc);
            for (int i = 0; i < 3; i++)
                ids[i] = add_shape(&s, make_sided(kind), DEM2D_FREE, vec(0.5 * i - 0.7, 0.25),
                                   0.3 * i, vec(0.6, -1), 0);
            for (int i = 0; i < 4000; i++) {
                step(&s, 10);
                contacts += contacts_of(&s, NULL, 0);
            }
            assert_true(contacts > 50);
            for (int i = 0; i < 3; i++) last[one][i] = grain_of(&s, ids[i]);
            close_scene(&s);
        }
        for (int i = 0; i < 3; i++) {
            assert_same_bits(last[0][i].pose.position.x, last[1][i].pose.position.x);
            assert_same_bits(last[0][i].pose.position.y, last[1][i].pose.position.y);
            assert_same_bits(last[0][i].velocity.x, last[1][i].velocity.x);
            assert_same_bits(last[0][i].angular_velocity, last[1][i].angular_velocity);
        }
    }
}

typedef struct shot {
    double deepest;  /* of the centre behind the target, along the way */
    double energy;   /* greatest change of the energy, over that of the shot */
    double closed;   /* part of the steps with a contact */
    dem2d_vec v, at; /* at the end, over the speed */
} shot;

/* A grain flies along a unit vector through a target at a wall, from twice its size before it, as
   fast as a spring stops over a depth on a straight face: m v^2 = kn d^2. */
static shot shoot(const dem2d_wall_desc *wall, int kind, dem2d_vec target, dem2d_vec way,
                  double depth) {
    scene s = make_scene(0, 1e-6, vec(0, 0), true);
    dem2d_wall_desc desc = *wall;
    dem2d_ledger ledger;
    shot out = {-1, 0, 0, {0, 0}, {0, 0}};
    desc.material = s.material;
    add_wall(&s, &desc);
    const dem2d_vec from = vec(target.x - 0.15 * way.x, target.y - 0.15 * way.y);
    const dem2d_particle_id id =
        add_shape(&s, make_sided(kind), DEM2D_FREE, from, 0.1, vec(0, 0), 0);
    const double speed = depth * sqrt(KN / grain_of(&s, id).mass);
    const int steps = (int)(0.5 / speed * 1e6);
    set_velocity(&s, id, DEM2D_FREE, vec(speed * way.x, speed * way.y), 0);
    for (int i = 0; i < steps; i++) {
        step(&s, 1);
        const dem2d_vec x = grain_of(&s, id).pose.position;
        out.deepest = fmax(out.deepest, (x.x - target.x) * way.x + (x.y - target.y) * way.y);
        ledger = ledger_of(&s);
        out.energy = fmax(out.energy, fabs(ledger.closure));
        out.closed += (double)(contacts_of(&s, NULL, 0) > 0) / steps;
    }
    const dem2d_particle_info info = grain_of(&s, id);
    out.energy /= 0.5 * info.mass * speed * speed;
    out.v = vec(info.velocity.x / speed, info.velocity.y / speed), out.at = info.pose.position;
    close_scene(&s);
    return out;
}

/* Pressed in until the centre is far behind the face, and pushed back to the left; over faces and
   vertices of a chain, and on a lone segment. The energy stays where the grain is a disc or beside
   one face. */
static void test_deep(void **state) {
    (void)state;
    static const double at[5] = {-0.45, -0.3, -0.15, -0.02, 0.03};
    dem2d_wall_desc floor = {0}, line = {0};
    floor.points = floor_points, floor.count = 6, floor.one_sided = true;
    line.segment = line.one_sided = true, line.point = vec(-1, 0), line.end = vec(1, 0);
    for (int kind = 0; kind < SIDED_KINDS; kind++)
        for (int i = 0; i < 6; i++)
            for (int k = -1; k <= 1; k++) {
                const dem2d_vec way = vec(sin(0.4 * k), -cos(0.4 * k));
                const double x = i < 5 ? at[i] : 0;
                const dem2d_vec target = vec(x, x > 0 ? 0.2 * x : 0);
                const shot out = shoot(i < 5 ? &floor : &line, kind, target, way, 0.085);
                assert_true(out.deepest > 0.02 && out.deepest < 0.06);
                assert_true(out.v.y > 0 && out.at.y > 0.2 * fmax(0, out.at.x));
                if (kind == SIDED_DISC || i < 3 || i == 5) assert_true(out.energy < 1e-6);
                if (kind == SIDED_DISC && (i < 3 || i == 5)) {
                    assert_within(out.v.x, way.x, 1e-5);
                    assert_within(out.v.y, -way.y, 1e-5);
                }
            }
}

/* Deeper than its diameter: it is gone, as documented. */
static void test_too_deep(void **state) {
    (void)state;
    dem2d_wall_desc line = {0};
    line.segment = line.one_sided = true, line.point = vec(-1, 0), line.end = vec(1, 0);
    const shot held = shoot(&line, SIDED_DISC, vec(0, 0), vec(0, -1), 0.099);
    const shot gone = shoot(&line, SIDED_DISC, vec(0, 0), vec(0, -1), 0.101);
    assert_true(held.v.y > 0.99 && held.deepest > 0.048);
    assert_true(gone.v.y < 0 && gone.at.y < -0.05);
}

/* From the right a grain flies on as if there were no wall, also over vertices and past free ends,
   whose sides push what has corners. */
static void test_from_behind(void **state) {
    (void)state;
    static const double at[7] = {-2, -0.6, -0.3, -0.1, 0, 0.5, 2};
    dem2d_wall_desc floor = {0};
    floor.points = floor_points, floor.count = 6, floor.one_sided = true;
    for (int kind = 0; kind < SIDED_KINDS; kind++)
        for (int i = 0; i < 7; i++)
            for (int k = -2; k <= 2; k++) {
                const dem2d_vec way = vec(sin(0.5 * k), cos(0.5 * k));
                const double y = i == 0 ? 0.5 : i == 5 ? 0.1 : 0;
                if (kind != SIDED_DISC && (i == 0 || i == 6)) continue;
                const shot out = shoot(&floor, kind, vec(at[i], y), way, 0.05);
                assert_true(out.closed == 0);
                assert_within(out.v.x, way.x, 1e-12);
            }
}

/* A box of one-sided walls holds grains at rest and one that two sides would lose; all goes on the
   same from a snapshot, and in any order of the neighbour list. */
static void test_box_of_one_side(void **state) {
    (void)state;
    const dem2d_vec corners[4] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    for (int way = 0; way < 3; way++) {
        uint64_t hash = 0;
        for (int run = 0; run < 2; run++) {
            dem2d_material_desc material = stone_desc(KN / 2, 0.3);
            dem2d_world_desc world = {0};
            material.damping_ratio = 0.2;
            world.time_step = 1e-5, world.gravity = vec(0, -9.81), world.skin = run ? 0.3 : 0;
            scene s = open_scene(&world, &material);
            dem2d_wall_desc box = chain_desc(&s, corners, 4, true);
            dem2d_particle_id ids[50];
            box.one_sided = true;
            add_wall(&s, &box);
            for (int i = 0; i < 50; i++) {
                dem2d_particle_desc grain =
                    grain_desc(&s, give_shape(&s, make_sided(i % SIDED_KINDS)), 0.6,
                               vec(0.1 + 0.088 * (i % 10), 0.1 + 0.09 * (i / 10)));
                grain.angle = i;
                if (i == 44) grain.velocity = vec(50 * cos(0.8 * way), 50 * sin(0.8 * way));
                ids[i] = add_grain(&s, &grain);
            }
            for (int k = 0; k < 3; k++) {
                step(&s, 2000);
                if (run == 0) continue;
                scene_bytes saved = scene_save(s.world);
                const scene old = s;
                s = scene_load(&old, &saved);
                close_scene(&old);
                free(saved.bytes);
            }
            for (int i = 0; i < 50; i++) {
                const dem2d_vec x = grain_of(&s, ids[i]).pose.position;
                assert_true(x.x > 0 && x.x < 1 && x.y > 0 && x.y < 1);
            }
            if (run == 1) assert_true(dem2d_world_hash(s.world) == hash);
            hash = dem2d_world_hash(s.world);
            close_scene(&s);
        }
    }
}

/* Refused for half-planes; kept in the desc; sides may be changed: contacts end then. */
static void test_sides_set(void **state) {
    (void)state;
    test_env env;
    test_env_init(&env);
    dem2d_world_desc world = {0};
    world.time_step = 1e-5, world.env = &env.env;
    const dem2d_material_desc material = stone_desc(KN, 0);
    scene s = open_scene(&world, &material);
    dem2d_wall_desc desc = plane_desc(&s, vec(0, 0), vec(0, 1));
    dem2d_wall_id id;
    desc.one_sided = true;
    assert_result(dem2d_world_add_wall(s.world, &desc, &id), DEM2D_OUT_OF_RANGE);
    assert_logged(&env, DEM2D_OUT_OF_RANGE, -1, "one_sided");
    desc.segment = true, desc.end = vec(1, 0), desc.one_sided = false;
    id = add_wall(&s, &desc);
    add_shape(&s, make_disc(0.05), DEM2D_FREE, vec(0.5, -0.04), 0, vec(0, 0), 0);
    step(&s, 1);
    assert_int_equal(contacts_of(&s, NULL, 0), 1);
    const uint64_t before = dem2d_world_hash(s.world);
    desc.one_sided = true;
    assert_ok(dem2d_world_set_wall(s.world, id, &desc));
    assert_true(dem2d_world_hash(s.world) != before);
    step(&s, 10);
    assert_int_equal(contacts_of(&s, NULL, 0), 0);
    desc.one_sided = false;
    assert_ok(dem2d_world_get_wall_desc(s.world, id, &desc));
    assert_true(desc.one_sided);
    desc.one_sided = false;
    assert_ok(dem2d_world_set_wall(s.world, id, &desc));
    step(&s, 1);
    assert_int_equal(contacts_of(&s, NULL, 0), 1);
    close_scene(&s);
    assert_clean(&env);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_turning_frame), cmocka_unit_test(test_coriolis),
        cmocka_unit_test(test_whole_turns),   cmocka_unit_test(test_belt),
        cmocka_unit_test(test_drum),          cmocka_unit_test(test_drive),
        cmocka_unit_test(test_blade),         cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_set_again),     cmocka_unit_test(test_front_is_the_same),
        cmocka_unit_test(test_deep),          cmocka_unit_test(test_too_deep),
        cmocka_unit_test(test_from_behind),   cmocka_unit_test(test_box_of_one_side),
        cmocka_unit_test(test_sides_set),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
