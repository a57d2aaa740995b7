/* Callbacks for several processes: sums of forces that the caller may change, steps that it may
   refuse. Two worlds that each own half of a scene, with ghosts of the other half at the border,
   have the bits of one world. */
#include "dem2d.h"
#include "inside.h"
#include "testing.h"
#include "world_scene.h"

enum { GRAINS = 72, STEPS = 600 };

#define BORDER 0.25
#define STRIP 0.14 /* of ghosts on the other side: three grains, more than any of them moves */

/* A world with all of the grains or a part of them. */
typedef struct part {
    scene s;
    int side;                      /* -1 left, 1 right, 0 all */
    struct part *other;            /* which owns the ghosts */
    dem2d_particle_id ids[GRAINS]; /* generation 0: not here */
    bool own[GRAINS];
    dem2d_vec force[GRAINS]; /* of the own, as they were found last */
    double torque[GRAINS];
    bool refuse; /* the next step, when its sums are known */
    int asked;
    dem2d_result last; /* what commit got */
} part;

/* The own sums go to the other part, those of ghosts come from it. */
static void trade(void *user, dem2d_sums *sums) {
    part *p = user;
    assert_int_equal(sums->walls, 4);
    for (int i = 0; i < GRAINS; i++) {
        const uint32_t row = p->ids[i].index;
        if (p->ids[i].generation == 0) continue;
        assert_true((int)row < sums->particles);
        if (p->own[i]) {
            p->force[i] = sums->force[row], p->torque[i] = sums->torque[row];
        } else {
            sums->force[row] = p->other->force[i], sums->torque[row] = p->other->torque[i];
        }
    }
}

static dem2d_result agree(void *user, dem2d_result result) {
    part *p = user;
    p->asked++, p->last = result;
    return p->refuse ? DEM2D_IO : DEM2D_OK;
}

/* The grains in rows; those of the part in their order from the last to the first, so that ids
   differ from one world to the other. */
static void make_part(part *p, int side, bool dashed) {
    static const dem2d_vec box[4] = {{0, 0}, {0.05, 0}, {0.05, 0.03}, {0, 0.03}};
    static const double a[5] = {0.05, 0, 0.002, 0.001, 0.0005}, b[5] = {0, 0, 0, 0.001, 0};
    dem2d_material_desc stone = material_desc(2500, 1e5, 8e4, 0.4);
    dem2d_world_desc desc;
    dem2d_particle_desc grains[GRAINS];
    uint64_t random = 3;
    memset(p, 0, sizeof *p);
    memset(&desc, 0, sizeof desc);
    p->side = side;
    desc.time_step = 1e-4, desc.gravity = vec(0.2, -9.81);
    if (side != 0) desc.gather = trade, desc.commit = agree, desc.exchange_user = p;
    if (dashed) stone.damping_ratio = 0.1, stone.rolling_friction = 0.03;
    p->s = open_scene(&desc, &stone);
    const dem2d_shape_id shapes[4] = {
        give_shape(&p->s, make_disc(0.024)), give_shape(&p->s, make_polygon(box, 4, 0)),
        give_shape(&p->s, make_ellipse(0.028, 0.02)), give_shape(&p->s, make_series(a, b, 4))};
    (void)add_plane(&p->s, 0, 0, 0, 1);
    (void)add_plane(&p->s, 0, 0, 1, 0);
    (void)add_plane(&p->s, 2 * BORDER, 0, -1, 0);
    (void)add_segment(&p->s, vec(0.1, 0.01), vec(0.4, 0.02));
    for (int i = 0; i < GRAINS; i++) {
        const dem2d_vec at = vec(0.03 + 0.055 * (i % 9), 0.06 + 0.047 * (i / 9));
        grains[i] = grain_desc(&p->s, shapes[i % 4], random_between(&random, 0.8, 1), at);
        grains[i].angle = random_between(&random, 0, 3);
        grains[i].velocity = vec(random_between(&random, -1, 1), random_between(&random, -1, 0));
        grains[i].angular_velocity = random_between(&random, -5, 5);
        grains[i].name = (uint64_t)i * 1000003 + 17;
        p->own[i] = side == 0 || (at.x < BORDER) == (side < 0);
    }
    for (int k = 0; k < GRAINS; k++) {
        const int i = side == 0 ? k : GRAINS - 1 - k;
        const double beyond = (grains[i].position.x - BORDER) * -side;
        if (side == 0 || beyond < STRIP) p->ids[i] = add_grain(&p->s, &grains[i]);
    }
}

/* Each grain of a part is where it is in the whole; ghosts too. Returns how many there are. */
static int check_part(const part *p, const part *whole) {
    int count = 0;
    for (int i = 0; i < GRAINS; i++) {
        if (p->ids[i].generation == 0) continue;
        const dem2d_particle_info a = grain_of(&p->s, p->ids[i]);
        const dem2d_particle_info b = grain_of(&whole->s, whole->ids[i]);
        assert_same_bits(a.pose.position.x, b.pose.position.x);
        assert_same_bits(a.pose.position.y, b.pose.position.y);
        assert_same_bits(a.pose.rotation.s, b.pose.rotation.s);
        assert_same_bits(a.velocity.x, b.velocity.x);
        assert_same_bits(a.angular_velocity, b.angular_velocity);
        if (p->own[i]) assert_same_bits(a.force.x, b.force.x);
        count++;
    }
    return count;
}

/* Contacts in the whole between grains that different parts own. */
static int across(const part *whole, const part *left) {
    dem2d_contact_info list[512];
    const int count = contacts_of(&whole->s, list, COUNT_OF(list));
    int found = 0;
    for (int k = 0; k < count; k++) {
        if (list[k].b.generation == 0) continue;
        const int a = (int)list[k].a.index, b = (int)list[k].b.index; /* added in their order */
        found += left->own[a] != left->own[b];
    }
    return found;
}

/* One part is tried and refused first, so that its sums are known to the other. */
static void step_parts(part *left, part *right) {
    const uint64_t before = dem2d_world_hash(right->s.world);
    right->refuse = true;
    assert_result(dem2d_world_step(right->s.world, 1, NULL), DEM2D_IO);
    assert_true(dem2d_world_hash(right->s.world) == before);
    right->refuse = false;
    step(&left->s, 1), step(&right->s, 1);
}

static void test_two_worlds(void **state) {
    (void)state;
    for (int dashed = 0; dashed < 2; dashed++) {
        static part whole, left, right;
        int met = 0;
        make_part(&whole, 0, dashed == 1);
        make_part(&left, -1, dashed == 1), make_part(&right, 1, dashed == 1);
        left.other = &right, right.other = &left;
        for (int k = 0; k < STEPS; k++) {
            step(&whole.s, 1), step_parts(&left, &right);
            met += across(&whole, &left);
            if (k % 50 != 49) continue;
            assert_between(check_part(&left, &whole), GRAINS / 2 + 8, GRAINS - 8);
            assert_between(check_part(&right, &whole), GRAINS / 2 + 8, GRAINS - 8);
        }
        assert_true(met > STEPS);
        assert_true(inside_holds(left.s.world) && inside_holds(right.s.world));
        assert_int_equal(right.asked, 2 * STEPS);
        close_scene(&whole.s), close_scene(&left.s), close_scene(&right.s);
    }
}

/* --- forces that the caller adds ---------------------------------------------------------------
 */

typedef struct pusher {
    dem2d_vec force;
    double torque;
    dem2d_vec on_wall;
    int calls;
} pusher;

static void push(void *user, dem2d_sums *sums) {
    pusher *p = user;
    p->calls++;
    for (int i = 0; i < sums->particles; i++) {
        sums->force[i].x += p->force.x, sums->force[i].y += p->force.y;
        sums->torque[i] += p->torque;
    }
    for (int i = 0; i < sums->walls; i++) sums->wall_force[i] = p->on_wall;
}

/* x = a t (t + dt)/2 of the leapfrog, the same for the angle of a frictionless circle. */
static void test_added_force(void **state) {
    (void)state;
    pusher p = {{3, -2}, 0.5, {7, 8}, 0};
    dem2d_world_desc desc;
    const dem2d_material_desc stone = stone_desc(0, 0);
    memset(&desc, 0, sizeof desc);
    desc.time_step = 1e-3, desc.gather = push, desc.exchange_user = &p, desc.ledger = true;
    const scene s = open_scene(&desc, &stone);
    const dem2d_particle_id id =
        add_shape(&s, make_disc(0.05), DEM2D_FREE, vec(0, 0), 0, vec(0, 0), 0);
    const dem2d_wall_id wall = add_plane(&s, 0, -5, 0, 1);
    step(&s, 200);
    const dem2d_particle_info info = grain_of(&s, id);
    const double t = 0.2 * 0.201 / 2;
    assert_near(info.pose.position.x, p.force.x / info.mass * t, 1e-12);
    assert_near(info.pose.position.y, p.force.y / info.mass * t, 1e-12);
    assert_near(angle_of(&s, id), p.torque / info.inertia * t, 1e-12);
    assert_same_bits(wall_of(&s, wall).force.y, 8);
    assert_int_equal(p.calls, 200);
    close_scene(&s);
}

/* What is not finite is refused, and leaves all as it was. */
static void test_bad_sums(void **state) {
    (void)state;
    const double bad[] = {NAN, INFINITY, -1e308};
    for (int k = 0; k < 4; k++) {
        pusher p = {{0, 0}, 0, {0, 0}, 0};
        dem2d_world_desc desc;
        test_env env;
        const dem2d_material_desc stone = stone_desc(1e6, 0.3);
        memset(&desc, 0, sizeof desc);
        test_env_init(&env);
        desc.time_step = 1e-4, desc.gravity = vec(0, -10), desc.env = &env.env;
        desc.gather = push, desc.exchange_user = &p, desc.ledger = true;
        const scene s = open_scene(&desc, &stone);
        (void)add_floor(&s);
        for (int i = 0; i < 5; i++)
            (void)add_shape(&s, make_disc(0.05), DEM2D_FREE, vec(0.09 * i, 0.0495), 0, vec(0, 0),
                            0);
        step(&s, 100);
        const uint64_t before = dem2d_world_hash(s.world);
        const dem2d_ledger ledger = ledger_of(&s);
        if (k < 3)
            p.force.x = p.torque = bad[k];
        else
            p.on_wall.x = NAN;
        assert_result(dem2d_world_step(s.world, 1, NULL), DEM2D_STATE);
        const dem2d_ledger after = ledger_of(&s);
        assert_true(dem2d_world_hash(s.world) == before);
        assert_memory_equal(&ledger, &after, sizeof ledger);
        p.force = p.on_wall = vec(0, 0), p.torque = 0;
        step(&s, 100);
        close_scene(&s);
        assert_clean(&env);
    }
}

/* --- steps that are refused --------------------------------------------------------------------
 */

static dem2d_result answer(void *user, dem2d_result result) {
    part *p = user;
    p->asked++, p->last = result;
    return p->refuse ? DEM2D_IO : DEM2D_OK;
}

/* A heap with all that a step changes: a servo wall, friction, a ledger. */
static scene make_heap(part *p, const dem2d_env *env, bool asks) {
    dem2d_material_desc stone = stone_desc(5e6, 0.4);
    dem2d_world_desc desc;
    memset(&desc, 0, sizeof desc);
    memset(p, 0, sizeof *p);
    stone.damping_ratio = 0.2;
    desc.time_step = 1e-4, desc.gravity = vec(0, -10), desc.env = env, desc.ledger = true;
    if (asks) desc.commit = answer, desc.exchange_user = p;
    const scene s = open_scene(&desc, &stone);
    const dem2d_shape_id disc = give_shape(&s, make_disc(0.05));
    dem2d_wall_desc lid = plane_desc(&s, vec(0, 0.6), vec(0, -1));
    (void)add_floor(&s), (void)add_plane(&s, -0.06, 0, 1, 0), (void)add_plane(&s, 0.36, 0, -1, 0);
    lid.mode = DEM2D_WALL_SERVO, lid.stress = 500, lid.max_speed = 0.5, lid.length = 0.4;
    (void)add_wall(&s, &lid);
    for (int i = 0; i < 20; i++) {
        const dem2d_particle_desc grain =
            grain_desc(&s, disc, 1, vec(0.1 * (i % 4) + 0.01 * (i / 4 % 2), 0.06 + 0.1 * (i / 4)));
        (void)add_grain(&s, &grain);
    }
    return s;
}

/* Every third step is refused once: no bit is another, in the ledger neither. */
static void test_refused(void **state) {
    (void)state;
    part p, q;
    const scene s = make_heap(&p, NULL, true), t = make_heap(&q, NULL, false);
    for (int k = 0; k < 3000; k++) {
        p.refuse = k % 3 == 1;
        if (p.refuse) assert_result(dem2d_world_step(s.world, 1, NULL), DEM2D_IO);
        p.refuse = false;
        step(&s, 1), step(&t, 1);
        if (k % 100 == 0) assert_true(dem2d_world_hash(s.world) == dem2d_world_hash(t.world));
    }
    const dem2d_ledger one = ledger_of(&s), other = ledger_of(&t);
    assert_memory_equal(&one, &other, sizeof one);
    assert_true(dem2d_world_hash(s.world) == dem2d_world_hash(t.world));
    assert_true(inside_holds(s.world));
    assert_int_equal(p.asked, 4000);
    int done = 7;
    p.refuse = true;
    assert_result(dem2d_world_step(s.world, 5, &done), DEM2D_IO);
    assert_int_equal(done, 0);
    close_scene(&s), close_scene(&t);
}

/* A step that can't be made is told to the callback, which can't allow it. */
static void test_own_errors(void **state) {
    (void)state;
    part p;
    test_env env;
    test_env_init(&env);
    const scene s = make_heap(&p, &env.env, true);
    step(&s, 2000);
    assert_true(p.last == DEM2D_OK);
    assert_ok(dem2d_world_set_time_step(s.world, 0.1));
    assert_result(dem2d_world_step(s.world, 1, NULL), DEM2D_TIME_STEP);
    assert_true(p.last == DEM2D_TIME_STEP);
    p.refuse = true;
    assert_result(dem2d_world_step(s.world, 1, NULL), DEM2D_TIME_STEP);
    p.refuse = false;
    assert_ok(dem2d_world_set_time_step(s.world, 1e-4));
    inside_renew_list(s.world), inside_scatter(s.world, true);
    test_env_fail(&env, 1);
    const int asked = p.asked;
    const dem2d_result result = dem2d_world_step(s.world, 1, NULL);
    assert_true(result == DEM2D_OK || result == DEM2D_OUT_OF_MEMORY);
    assert_true(p.last == result && p.asked == asked + 1);
    close_scene(&s);
    assert_clean(&env);
}

/* A loaded world has the callbacks of dem2d_load_desc. */
static void test_loaded(void **state) {
    (void)state;
    part p;
    const scene s = make_heap(&p, NULL, true);
    step(&s, 500);
    scene_bytes bytes = scene_save(s.world);
    pusher pushing = {{0, 0}, 0, {0, 0}, 0};
    dem2d_load_desc desc;
    scene t = s;
    memset(&desc, 0, sizeof desc);
    desc.read = scene_read, desc.user = &bytes, desc.gather = push, desc.exchange_user = &pushing;
    assert_ok(dem2d_world_load(&desc, NULL, &t.world));
    free(bytes.bytes);
    step(&s, 500), step(&t, 500);
    assert_int_equal(pushing.calls, 500);
    const dem2d_particle_id id = {3, 1};
    assert_near(grain_of(&t, id).pose.position.y, grain_of(&s, id).pose.position.y, 1e-12);
    close_scene(&s), close_scene(&t);
}

/* Torques on a wall that turns: the callback gets those of the contacts, and what it leaves is in
   the work of the ledger. */
typedef struct motor {
    double torque, factor; /* that was got; by which it is changed */
} motor;

static void turn_motor(void *user, dem2d_sums *sums) {
    motor *m = user;
    assert_int_equal(sums->walls, 1);
    m->torque = sums->wall_torque[0];
    sums->wall_torque[0] *= m->factor;
}

static void test_wall_torque(void **state) {
    (void)state;
    double work[2];
    for (int k = 0; k < 2; k++) {
        dem2d_material_desc stone = stone_desc(5e6, 0.5);
        dem2d_vec ring[24];
        dem2d_world_desc desc;
        motor m = {0, 1 + k};
        memset(&desc, 0, sizeof desc);
        desc.time_step = 1e-4, desc.gravity = vec(0, -9.81), desc.ledger = true;
        stone.damping_ratio = 0.3;
        desc.gather = turn_motor, desc.exchange_user = &m;
        const scene s = open_scene(&desc, &stone);
        dem2d_wall_desc drum = plane_desc(&s, vec(0, 0), vec(0, 0));
        for (int i = 0; i < 24; i++) {
            const dem2d_vec u = direction(i * 2 * (double)TEST_PI / 24);
            ring[i] = vec(0.1 + 0.3 * u.x, 0.3 * u.y);
        }
        drum.points = ring, drum.count = 24, drum.closed = true, drum.pivot = vec(0.1, 0);
        drum.mode = DEM2D_WALL_MOVING, drum.angular_velocity = 2;
        const dem2d_wall_id wall = add_wall(&s, &drum);
        for (int i = 0; i < 12; i++)
            add_shape(&s, make_disc(0.04), DEM2D_FREE, vec(0.085 * (i % 4), 0.1 - 0.085 * (i / 4)),
                      0, vec(0, 0), 0);
        for (int n = 0; n < 200; n++) {
            step(&s, 50);
            assert_within(m.torque, wall_of(&s, wall).torque, 1e-12 * 12 * 13.6 * 9.81);
        }
        assert_true(m.torque < -1); /* the grains lie behind the lowest point */
        work[k] = ledger_of(&s).walls;
        close_scene(&s);
    }
    assert_true(work[0] > 1);
    assert_near(work[1], 2 * work[0], 1e-12); /* the wall moves by its angular velocity alone */
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_two_worlds), cmocka_unit_test(test_added_force),
        cmocka_unit_test(test_bad_sums),   cmocka_unit_test(test_refused),
        cmocka_unit_test(test_own_errors), cmocka_unit_test(test_loaded),
        cmocka_unit_test(test_wall_torque)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
