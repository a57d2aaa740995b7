/* Events: contacts that close and open, with approach speed, impulse and greatest force. */
#include "dem2d.h"
#include "inside.h"
#include "testing.h"
#include "world_scene.h"

enum { MOST = 4000 };

static dem2d_world_desc events_desc(double time_step, int capacity) {
    dem2d_world_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.time_step = time_step, desc.event_capacity = capacity;
    return desc;
}

/* Into a list with room for MOST; nothing may be lost. */
static int take(const scene *s, dem2d_contact_event *list) {
    int count;
    int64_t lost = -1;
    assert_ok(dem2d_world_events(s->world, list, MOST, &count, &lost));
    assert_true(lost == 0 && count < MOST);
    return count;
}

/* --- closed forms -------------------------------------------------------------------------------
 */

/* A disc on a floor without gravity: it meets it at v, and leaves with -v after pi (m/k)^(1/2); the
   impulse is m dv to the last bits, the greatest force v (k m)^(1/2). */
static void test_bounce(void **state) {
    (void)state;
    const double v = 2, k = 1e6, dt = 1e-6;
    const dem2d_world_desc desc = events_desc(dt, 10);
    const dem2d_material_desc stone = material_desc(2700, k, 0, 0);
    const scene s = open_scene(&desc, &stone);
    const dem2d_wall_id floor = add_floor(&s);
    const dem2d_particle_id id =
        add_shape(&s, make_disc(0.05), DEM2D_FREE, vec(0.3, 0.051), 0, vec(1, -v), 0);
    const double m = grain_of(&s, id).mass;
    dem2d_contact_event e[MOST];
    step(&s, 100);
    assert_int_equal(take(&s, e), 0);
    step(&s, 30000);
    const double change = grain_of(&s, id).velocity.y + v;
    assert_int_equal(take(&s, e), 2);
    assert_true(e[0].kind == DEM2D_CONTACT_CLOSED && e[1].kind == DEM2D_CONTACT_OPENED);
    assert_true(e[0].step == e[0].since && e[1].since == e[0].since);
    assert_near((double)(e[0].step - 1) * dt, 0.001 / v, 2e-3);
    assert_near((double)(e[1].step - e[1].since) * dt, (double)TEST_PI * sqrt(m / k), 1e-3);
    for (int i = 0; i < 2; i++) {
        assert_memory_equal(&e[i].a, &id, sizeof id);
        assert_memory_equal(&e[i].wall, &floor, sizeof floor);
        assert_true(e[i].b.generation == 0);
        assert_true(e[i].normal.x == 0 && e[i].normal.y == -1);
        assert_within(e[i].point.y, 0, 2 * v * dt);
        assert_near(e[i].point.x, 0.3 + 0.001 / v, 1e-4);
        assert_near(e[i].speed, v, 1e-12);
    }
    assert_true(e[0].impulse == 0 && e[0].greatest_force == 0);
    assert_near(e[1].impulse, m * change, 1e-12);
    assert_near(change, 2 * v, 1e-3);
    assert_near(e[1].greatest_force, v * sqrt(k * m), 1e-6);
    close_scene(&s);
}

/* Two discs and a dashpot: the impulse is the reduced mass times (1 + restitution) times the
   approach speed, and m dv of each. */
static void test_collision(void **state) {
    (void)state;
    const dem2d_world_desc desc = events_desc(1e-6, 10);
    dem2d_material_desc stone = material_desc(2700, 1e6, 0, 0);
    assert_ok(dem2d_damping_ratio(0.6, &stone.damping_ratio));
    const scene s = open_scene(&desc, &stone);
    const dem2d_particle_id a =
        add_shape(&s, make_disc(0.05), DEM2D_FREE, vec(0, 0), 0, vec(1.5, 0), 0);
    const dem2d_particle_id b =
        add_shape(&s, make_disc(0.03), DEM2D_FREE, vec(0.081, 0), 0, vec(-0.5, 0), 0);
    const double ma = grain_of(&s, a).mass, mb = grain_of(&s, b).mass;
    dem2d_contact_event e[MOST];
    step(&s, 30000);
    assert_int_equal(take(&s, e), 2);
    assert_memory_equal(&e[1].b, &b, sizeof b);
    assert_true(e[1].wall.generation == 0 && e[1].normal.x == 1);
    assert_near(e[1].speed, 2, 1e-12);
    assert_near(e[1].impulse, ma * mb / (ma + mb) * 1.6 * 2, 2e-3);
    assert_near(e[1].impulse, ma * (1.5 - grain_of(&s, a).velocity.x), 1e-12);
    assert_near(e[1].impulse, mb * (grain_of(&s, b).velocity.x + 0.5), 1e-12);
    close_scene(&s);
}

/* Many hits between two questions: none is missing, and their impulses are the change of momentum.
 */
static void test_frame(void **state) {
    (void)state;
    const dem2d_world_desc desc = events_desc(1e-5, 1000);
    const dem2d_material_desc stone = material_desc(2700, 1e7, 0, 0);
    const scene s = open_scene(&desc, &stone);
    (void)add_plane(&s, 0, 0, 0, 1), (void)add_plane(&s, 0, 0.21, 0, -1);
    const dem2d_particle_id id =
        add_shape(&s, make_disc(0.1), DEM2D_FREE, vec(0, 0.105), 0, vec(0, 5), 0);
    dem2d_contact_event e[MOST];
    step(&s, 20000);
    const int count = take(&s, e);
    assert_between(count, 20, 200);
    double sum = 0;
    for (int i = 0; i < count; i++) {
        assert_true(e[i].kind == (i % 2 ? DEM2D_CONTACT_OPENED : DEM2D_CONTACT_CLOSED));
        sum -= e[i].impulse * e[i].normal.y;
    }
    const double momentum = grain_of(&s, id).mass * 5; /* what comes of all hits nearly cancels */
    assert_within(sum, momentum * (grain_of(&s, id).velocity.y / 5 - 1), 1e-9 * momentum);
    close_scene(&s);
}

/* --- heaps -------------------------------------------------------------------------------------
 */

enum { HEAP = 40 };

typedef struct heap {
    scene s;
    dem2d_particle_id ids[HEAP];
    dem2d_wall_id walls[5];
    int threads;
    bool refuse;
} heap;

static dem2d_result agree(void *user, dem2d_result result) {
    (void)result;
    return *(const bool *)user ? DEM2D_IO : DEM2D_OK;
}

/* Grains of several kinds, or circles, fall into a box with a chain of segments. */
static void make_heap(heap *h, const dem2d_env *env, bool circles, int threads, int capacity) {
    static const dem2d_vec box[4] = {{0, 0}, {0.09, 0}, {0.09, 0.06}, {0, 0.06}};
    dem2d_material_desc stone = stone_desc(5e6, 0.4);
    dem2d_world_desc desc = events_desc(1e-4, capacity);
    memset(h, 0, sizeof *h);
    h->threads = threads;
    desc.gravity = vec(1, -20), desc.env = env;
    desc.commit = agree, desc.exchange_user = &h->refuse;
    if (threads > 0) desc.parallel_for = run_parts, desc.parallel_user = &h->threads;
    h->s = open_scene(&desc, &stone);
    const dem2d_shape_id shapes[3] = {give_shape(&h->s, make_disc(0.05)),
                                      give_shape(&h->s, make_polygon(box, 4, 0)),
                                      give_shape(&h->s, make_ellipse(0.05, 0.03))};
    h->walls[0] = add_floor(&h->s);
    h->walls[1] = add_plane(&h->s, -0.06, 0, 1, 0), h->walls[2] = add_plane(&h->s, 0.6, 0, -1, 0);
    h->walls[3] = add_segment(&h->s, vec(0, 0.02), vec(0.3, 0.03));
    h->walls[4] = add_segment(&h->s, vec(0.3, 0.03), vec(0.5, 0.01));
    for (int i = 0; i < HEAP; i++) {
        dem2d_particle_desc grain =
            grain_desc(&h->s, shapes[circles ? 0 : i % 3], i % 4 == 0 ? 0.8 : 1,
                       vec(0.1 * (i % 5) + 0.03 * (i / 5 % 2), 0.1 + 0.11 * (i / 5)));
        grain.angular_velocity = 10 * (i % 7 - 3);
        h->ids[i] = add_grain(&h->s, &grain);
    }
}

/* What is closed, by hand. */
typedef struct pair {
    uint32_t a, b; /* walls from 1000 on */
    double impulse, greatest;
} pair;

static pair pair_of(dem2d_particle_id a, dem2d_particle_id b, dem2d_wall_id wall) {
    const pair p = {a.index, b.generation != 0 ? b.index : 1000 + wall.index, 0, 0};
    return p;
}

static int find(const pair *list, int count, const pair *p) {
    int i = 0;
    while (i < count && (list[i].a != p->a || list[i].b != p->b)) i++;
    return i;
}

/* Each step's contacts against those of the step before: closed ones are told, opened ones as well
   with the sum of force times time step; nothing else. */
static void check_by_hand(bool circles) {
    static dem2d_contact_event e[MOST];
    static dem2d_contact_info list[400];
    static pair open[400];
    heap h;
    int known = 0, events = 0;
    make_heap(&h, NULL, circles, 0, 1000);
    for (int k = 1; k <= 6000; k++) {
        step(&h.s, 1);
        const int count = contacts_of(&h.s, list, 400), told = take(&h.s, e);
        static pair now[400];
        int next = 0;
        events += told;
        for (int i = 0; i < count; i++) {
            now[next] = pair_of(list[i].a, list[i].b, list[i].wall);
            const int before = find(open, known, &now[next]);
            if (before < known) now[next] = open[before];
            const double force = list[i].normal_force;
            now[next].impulse += force * 1e-4;
            now[next].greatest = fmax(now[next].greatest, force);
            next++;
        }
        for (int i = 0; i < told; i++) {
            const pair p = pair_of(e[i].a, e[i].b, e[i].wall);
            const int before = find(open, known, &p), after = find(now, next, &p);
            assert_true(e[i].step == k);
            if (e[i].kind == DEM2D_CONTACT_CLOSED) {
                assert_true(before == known && after < next && e[i].since == k);
            } else {
                assert_true(before < known && after == next);
                assert_same_bits(e[i].impulse, open[before].impulse);
                assert_same_bits(e[i].greatest_force, open[before].greatest);
            }
        }
        int changed = 0;
        for (int i = 0; i < next; i++) changed += find(open, known, &now[i]) == known;
        for (int i = 0; i < known; i++) changed += find(now, next, &open[i]) == next;
        assert_int_equal(changed, told);
        memcpy(open, now, sizeof open), known = next;
    }
    assert_true(events > 300 && known > HEAP / 2);
    close_scene(&h.s);
}

static void test_by_hand(void **state) {
    (void)state;
    check_by_hand(true);
    check_by_hand(false);
}

static int events_of(heap *h, dem2d_contact_event *list, bool renew) {
    int count = 0;
    for (int k = 0; k < 40; k++) {
        if (renew) inside_renew_list(h->s.world), inside_scatter(h->s.world, k % 3 == 0);
        step(&h->s, 100);
    }
    count = take(&h->s, list);
    return count;
}

/* The same for any threads, list, order in memory. */
static void test_independent(void **state) {
    (void)state;
    static dem2d_contact_event one[MOST], other[MOST];
    for (int circles = 0; circles < 2; circles++) {
        heap h;
        make_heap(&h, NULL, circles == 1, 0, MOST);
        const int count = events_of(&h, one, false);
        close_scene(&h.s);
        assert_true(count > 200);
        for (int k = 0; k < 2; k++) {
            make_heap(&h, NULL, circles == 1, 3 * k, MOST);
            assert_int_equal(events_of(&h, other, true), count);
            close_scene(&h.s);
            assert_memory_equal(one, other, (size_t)count * sizeof *one);
        }
    }
}

/* What no longer finds room is counted: the oldest stay. */
static void test_overflow(void **state) {
    (void)state;
    static dem2d_contact_event all[MOST], few[MOST];
    heap h;
    int64_t lost;
    int count;
    make_heap(&h, NULL, false, 0, MOST);
    step(&h.s, 3000);
    const int total = take(&h.s, all);
    close_scene(&h.s);
    make_heap(&h, NULL, false, 0, 7);
    step(&h.s, 3000);
    assert_ok(dem2d_world_events(h.s.world, NULL, 0, &count, NULL));
    assert_int_equal(count, 0);
    assert_ok(dem2d_world_events(h.s.world, few, 3, &count, &lost));
    assert_int_equal(count, 3);
    assert_true(lost == 0); /* was told by the call before */
    assert_ok(dem2d_world_events(h.s.world, few + 3, MOST, &count, &lost));
    assert_int_equal(count, 4);
    assert_memory_equal(all, few, 7 * sizeof *all);
    step(&h.s, 1);
    close_scene(&h.s);
    make_heap(&h, NULL, false, 0, 7);
    step(&h.s, 3000);
    assert_ok(dem2d_world_events(h.s.world, few, MOST, &count, &lost));
    assert_true(count == 7 && lost == total - 7);
    close_scene(&h.s);
}

/* Edits end contacts at once: of what is moved or removed, and of walls; each contact opens once.
 */
static void test_edits(void **state) {
    (void)state;
    static dem2d_contact_event e[MOST];
    static dem2d_contact_info list[400];
    heap h;
    make_heap(&h, NULL, false, 0, MOST);
    for (int k = 0; k < 6; k++) step(&h.s, 1000), (void)take(&h.s, e);
    for (int round = 0; round < 4; round++) {
        const int count = contacts_of(&h.s, list, 400);
        const dem2d_particle_id id = list[round + 2].a;
        int expected = 0;
        for (int i = 0; i < count; i++) {
            const bool wall = list[i].b.generation == 0;
            expected += round == 3
                            ? wall && list[i].wall.index == h.walls[0].index
                            : list[i].a.index == id.index || (!wall && list[i].b.index == id.index);
        }
        if (round == 0) assert_ok(dem2d_world_remove_particle(h.s.world, id));
        if (round == 1) assert_ok(dem2d_world_move_particle(h.s.world, id, vec(0.2, 9), 0));
        if (round == 2) { /* twice */
            assert_ok(dem2d_world_move_particle(h.s.world, id, vec(0.3, 9.5), 0));
            assert_ok(dem2d_world_remove_particle(h.s.world, id));
        }
        if (round == 3) assert_ok(dem2d_world_remove_wall(h.s.world, h.walls[0]));
        const int told = take(&h.s, e);
        assert_true(expected > 0);
        assert_int_equal(told, expected);
        for (int i = 0; i < told; i++) {
            assert_true(e[i].kind == DEM2D_CONTACT_OPENED && e[i].impulse > 0);
            assert_true(e[i].step == stats_of(&h.s).steps && e[i].since > 0);
            if (round == 3) assert_memory_equal(&e[i].wall, &h.walls[0], sizeof h.walls[0]);
        }
        assert_true(inside_holds(h.s.world));
        step(&h.s, 1);
        for (int i = take(&h.s, e) - 1; i >= 0; i--) /* no second end of what has gone */
            assert_true(e[i].a.index != id.index || e[i].kind == DEM2D_CONTACT_CLOSED);
    }
    close_scene(&h.s);
}

/* Saved with what nobody has taken yet, and with what is closed. */
static void test_snapshot(void **state) {
    (void)state;
    static dem2d_contact_event one[MOST], other[MOST];
    heap h;
    make_heap(&h, NULL, false, 0, MOST);
    step(&h.s, 2500);
    scene_bytes bytes = scene_save(h.s.world);
    const scene t = scene_load(&h.s, &bytes);
    free(bytes.bytes);
    step(&h.s, 2500), step(&t, 2500);
    const int count = take(&h.s, one);
    assert_true(count > 200);
    assert_int_equal(take(&t, other), count);
    assert_memory_equal(one, other, (size_t)count * sizeof *one);
    close_scene(&h.s), close_scene(&t);
}

/* Steps that are refused tell nothing; without memory events are lost and counted, steps go on. */
static void test_refused(void **state) {
    (void)state;
    static dem2d_contact_event one[MOST], other[MOST];
    heap h, q;
    make_heap(&h, NULL, false, 0, MOST), make_heap(&q, NULL, false, 0, MOST);
    for (int k = 0; k < 3000; k++) {
        h.refuse = true;
        assert_result(dem2d_world_step(h.s.world, 1, NULL), DEM2D_IO);
        h.refuse = false;
        step(&h.s, 1);
    }
    step(&q.s, 3000);
    const int count = take(&q.s, other);
    assert_int_equal(take(&h.s, one), count);
    assert_memory_equal(one, other, (size_t)count * sizeof *one);
    close_scene(&h.s), close_scene(&q.s);
}

/* They change no bit of the motion; a world without them has no memory for them, and says so. */
static void test_off(void **state) {
    (void)state;
    test_env env;
    test_env_init(&env);
    heap h, q;
    int count = 7;
    make_heap(&h, &env.env, false, 0, 0), make_heap(&q, NULL, false, 0, 5);
    step(&h.s, 3000), step(&q.s, 3000);
    assert_true(dem2d_world_hash(h.s.world) == dem2d_world_hash(q.s.world));
    assert_true(stats_of(&h.s).bytes < stats_of(&q.s).bytes);
    assert_result(dem2d_world_events(h.s.world, NULL, 0, &count, NULL), DEM2D_OUT_OF_RANGE);
    assert_logged(&env, DEM2D_OUT_OF_RANGE, -1, "event_capacity");
    assert_int_equal(count, 7);
    assert_result(dem2d_world_events(q.s.world, NULL, -1, &count, NULL), DEM2D_OUT_OF_RANGE);
    assert_result(dem2d_world_events(q.s.world, NULL, 1, &count, NULL), DEM2D_NULL_ARGUMENT);
    close_scene(&h.s), close_scene(&q.s);
    assert_clean(&env);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_bounce),      cmocka_unit_test(test_collision),
        cmocka_unit_test(test_frame),       cmocka_unit_test(test_by_hand),
        cmocka_unit_test(test_independent), cmocka_unit_test(test_overflow),
        cmocka_unit_test(test_edits),       cmocka_unit_test(test_snapshot),
        cmocka_unit_test(test_refused),     cmocka_unit_test(test_off)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
