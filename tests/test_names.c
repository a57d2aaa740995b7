/* Names order pairs and sums: a scene that is built in another order has the same bits for each
   name, and has not without names. */
#include "dem2d.h"
#include "inside.h"
#include "testing.h"
#include "row_law.h"
#include "world_scene.h"

enum { GRAINS = 48, LATE = 12, WALLS = 7, STEPS = 1500 };

/* What a scene has. */
typedef enum what { PLAIN, RUBBING, SHAPES, DASHED, LAW, WHATS } what;

static const char *const whats[WHATS] = {"circles", "friction", "shapes", "dashpots", "law"};

/* How it is built. */
typedef struct order {
    uint64_t seed; /* of the order in which grains and walls are added; 0: as they come */
    bool named;
    int threads; /* 0: no parallel_for */
} order;

typedef struct pile {
    scene s;
    what has;
    order how;
    uint64_t random; /* of what comes next: the same in all orders */
    dem2d_shape_id shapes[6];
    int shape_count;
    dem2d_particle_id grains[GRAINS + LATE]; /* by what their names come from */
    dem2d_wall_id walls[WALLS];
    dem2d_vec left[LATE]; /* where those were that have gone */
    int threads;
} pile;

/* Names as they may be: far apart, also above 2^63, in no order. */
static uint64_t name_of(int i) {
    return ((uint64_t)i + 1) * 0x9E3779B97F4A7C15u;
}

/* A spring, a dashpot, and a moment that depends on who is A. */
static void simple_law_row(void *user, const row_in *in, row_out *out) {
    (void)user;
    out->normal_force = in->pair.normal_stiffness * in->depth + 20 * in->mass * in->approach;
    out->tangential_force = -100 * in->sliding;
    out->moment = -1e-5 * in->spin * out->normal_force;
    out->energy = in->pair.normal_stiffness * in->depth * in->depth / 2;
}

static void simple_law(void *user, dem2d_law_batch *batch) {
    for_rows(user, batch, simple_law_row);
}

static void shuffle(int *items, int count, uint64_t seed) {
    for (int i = 0; i < count; i++) items[i] = i;
    if (seed == 0) return;
    for (int i = count - 1; i > 0; i--) {
        const int k = (int)random_between(&seed, 0, i + 1), item = items[i];
        items[i] = items[k], items[k] = item;
    }
}

static void add_shapes(pile *p) {
    static const dem2d_vec box[4] = {{0, 0}, {0.05, 0}, {0.05, 0.03}, {0, 0.03}};
    static const dem2d_vec kite[5] = {{0, 0}, {0.03, -0.01}, {0.05, 0.02}, {0.03, 0.04}, {0, 0.03}};
    static const double a[5] = {0.05, 0, 0.002, 0.001, 0.0005}, b[5] = {0, 0, 0, 0.001, 0};
    static const double reach[4] = {0.03, 0.02, 0.025, 0.02};
    p->shapes[p->shape_count++] = give_shape(&p->s, make_disc(0.025));
    if (p->has < SHAPES) return;
    p->shapes[p->shape_count++] = give_shape(&p->s, make_polygon(box, 4, 0));
    p->shapes[p->shape_count++] = give_shape(&p->s, make_polygon(kite, 5, 0.004));
    p->shapes[p->shape_count++] = give_shape(&p->s, make_ellipse(0.03, 0.02));
    p->shapes[p->shape_count++] = give_shape(&p->s, make_series(a, b, 4));
    p->shapes[p->shape_count++] = give_shape(&p->s, make_oval(reach, 0.5522847498));
}

/* A box with a lid by servo, a moving wall below, and a chain of two segments. */
static dem2d_wall_desc wall_desc(const pile *p, int i) {
    static const dem2d_vec at[WALLS] = {{0, 0}, {0, 0}, {0.5, 0}, {0, 0.56}, {0, 0}, {0, 0.1}};
    static const dem2d_vec out[WALLS] = {{0, 1}, {1, 0}, {-1, 0}, {0, -1}, {0, 1}, {0, 0}};
    dem2d_wall_desc desc = plane_desc(&p->s, at[i], out[i]);
    if (i == 3) desc.mode = DEM2D_WALL_SERVO, desc.stress = 2000, desc.max_speed = 2;
    if (i == 3) desc.length = 0.5;
    if (i == 4) desc.mode = DEM2D_WALL_MOVING, desc.velocity = vec(0, 0.02);
    if (i >= 5) desc.segment = true, desc.point = vec(0, 0.1), desc.end = vec(0.1, 0.06);
    if (i == 6) desc.point = vec(0.1, 0.06), desc.end = vec(0.2, 0.05);
    if (p->how.named) desc.name = name_of(i);
    return desc;
}

static dem2d_particle_desc pile_grain(pile *p, int i) {
    const double x = 0.035 + 0.053 * (i % 8), y = 0.15 + 0.06 * (i / 8);
    dem2d_particle_desc desc = grain_desc(&p->s, p->shapes[i % p->shape_count], 1, vec(x, y));
    desc.scale = random_between(&p->random, 0.7, 1);
    if (i >= GRAINS) desc.position = p->left[i - GRAINS], desc.scale *= 0.8;
    desc.velocity = vec(random_between(&p->random, -1, 1), random_between(&p->random, -1, 1));
    if (p->has != PLAIN) desc.angular_velocity = random_between(&p->random, -9, 9);
    if (i == 5) desc.motion = DEM2D_DRIVEN, desc.velocity = vec(0.01, 0);
    if (p->how.named) desc.name = name_of(i);
    return desc;
}

/* Grains from begin to before end in the order of the pile. */
static void add_grains(pile *p, int begin, int end) {
    dem2d_particle_desc descs[GRAINS];
    int items[GRAINS];
    for (int i = begin; i < end; i++) descs[i - begin] = pile_grain(p, i);
    shuffle(items, end - begin, p->how.seed);
    for (int k = 0; k < end - begin; k++)
        p->grains[begin + items[k]] = add_grain(&p->s, &descs[items[k]]);
}

static void make_pile(pile *p, what has, order how) {
    dem2d_material_desc stone = material_desc(2500, 1e5, 8e4, has == PLAIN ? 0 : 0.4);
    dem2d_world_desc desc;
    int items[WALLS];
    memset(p, 0, sizeof *p);
    memset(&desc, 0, sizeof desc);
    p->has = has, p->how = how, p->random = 5, p->threads = how.threads;
    desc.time_step = 2e-4, desc.gravity = vec(0.3, -9.81), desc.ledger = true;
    desc.local_damping = 0.02;
    desc.parallel_for = how.threads > 0 ? run_parts : NULL, desc.parallel_user = &p->threads;
    if (has == LAW) desc.law = simple_law;
    if (has == DASHED) stone.damping_ratio = 0.1, stone.rolling_friction = 0.05;
    p->s = open_scene(&desc, &stone);
    add_shapes(p);
    shuffle(items, WALLS, how.seed);
    for (int k = 0; k < WALLS; k++) {
        const dem2d_wall_desc wall = wall_desc(p, items[k]);
        p->walls[items[k]] = add_wall(&p->s, &wall);
    }
    add_grains(p, 0, GRAINS);
}

/* Some leave, others come in their place, one wall as well. */
static void edit_pile(pile *p) {
    int items[LATE];
    shuffle(items, LATE, p->how.seed + 1);
    for (int k = 0; k < LATE; k++) {
        const dem2d_particle_id id = p->grains[3 * items[k] + 1];
        p->left[items[k]] = grain_of(&p->s, id).pose.position;
        assert_ok(dem2d_world_remove_particle(p->s.world, id));
    }
    add_grains(p, GRAINS, GRAINS + LATE);
    assert_ok(dem2d_world_remove_wall(p->s.world, p->walls[1]));
    const dem2d_wall_desc wall = wall_desc(p, 1);
    p->walls[1] = add_wall(&p->s, &wall);
}

static bool alive(int i) {
    return i >= GRAINS || i % 3 != 1 || i / 3 >= LATE;
}

static bool same(const void *a, const void *b, size_t size) {
    return memcmp(a, b, size) == 0;
}

/* Have two piles the same bits for each name? */
static bool piles_agree(const pile *p, const pile *q) {
    bool agree = true;
    for (int i = 0; i < GRAINS + LATE; i++) {
        if (!alive(i)) continue;
        const dem2d_particle_info a = grain_of(&p->s, p->grains[i]),
                                  b = grain_of(&q->s, q->grains[i]);
        agree = agree && same(&a.pose, &b.pose, sizeof a.pose) &&
                same(&a.velocity, &b.velocity, sizeof a.velocity) &&
                same(&a.angular_velocity, &b.angular_velocity, sizeof a.angular_velocity) &&
                same(&a.force, &b.force, sizeof a.force) &&
                same(&a.torque, &b.torque, sizeof a.torque) && a.name == b.name;
    }
    for (int i = 0; i < WALLS; i++) {
        const dem2d_wall_info a = wall_of(&p->s, p->walls[i]), b = wall_of(&q->s, q->walls[i]);
        agree = agree && same(&a.point, &b.point, sizeof a.point) &&
                same(&a.force, &b.force, sizeof a.force) && a.name == b.name;
    }
    const dem2d_ledger one = ledger_of(&p->s), other = ledger_of(&q->s);
    const dem2d_energy e = energy_of(&p->s), f = energy_of(&q->s);
    return agree && same(&one, &other, sizeof one) && same(&e, &f, sizeof e);
}

static int compare_names(const void *a, const void *b) {
    const uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return (x > y) - (x < y);
}

/* Contacts come in the order of names: of A, then of B. */
static int check_contacts(const pile *p) {
    dem2d_contact_info list[512];
    uint64_t last[3] = {0, 0, 0};
    const int count = contacts_of(&p->s, list, COUNT_OF(list));
    assert_true(count <= COUNT_OF(list));
    for (int i = 0; i < count; i++) {
        const bool wall = list[i].b.generation == 0;
        const uint64_t at[3] = {wall, grain_of(&p->s, list[i].a).name,
                                wall ? wall_of(&p->s, list[i].wall).name
                                     : grain_of(&p->s, list[i].b).name};
        int k = 0;
        assert_true(wall || at[1] < at[2]);
        while (k < 2 && at[k] == last[k]) k++;
        assert_true(compare_names(&last[k], &at[k]) < 0 || i == 0);
        memcpy(last, at, sizeof last);
    }
    return count;
}

static void run(pile *p) {
    step(&p->s, STEPS);
    edit_pile(p);
    assert_true(inside_holds(p->s.world));
    step(&p->s, STEPS);
    assert_true(inside_holds(p->s.world));
}

static void test_shuffled(void **state) {
    static const order straight = {0, true, 0};
    static const order others[] = {{7, true, 0}, {8, true, 3}, {0, true, 8}};
    (void)state;
    for (int has = 0; has < WHATS; has++) {
        pile p, q;
        make_pile(&p, (what)has, straight);
        run(&p);
        if (check_contacts(&p) < GRAINS / 2) fail_msg("%s: few contacts", whats[has]);
        for (int k = 0; k < COUNT_OF(others); k++) {
            make_pile(&q, (what)has, others[k]);
            run(&q);
            if (!piles_agree(&p, &q)) fail_msg("%s: order %d has other bits", whats[has], k);
            close_scene(&q.s);
        }
        close_scene(&p.s);
    }
}

/* The order matters: without names the ids decide, and the sums are others. */
static void test_unnamed(void **state) {
    (void)state;
    pile p, q;
    make_pile(&p, SHAPES, (order){0, false, 0});
    make_pile(&q, SHAPES, (order){7, false, 0});
    run(&p), run(&q);
    assert_false(piles_agree(&p, &q));
    close_scene(&p.s), close_scene(&q.s);
}

/* Names that rise with the ids change no bit, nor do equal ones. */
static void test_same_order(void **state) {
    uint64_t hash[3];
    (void)state;
    for (int k = 0; k < 3; k++) {
        const dem2d_material_desc stone = material_desc(2500, 1e5, 8e4, 0.4);
        dem2d_world_desc desc;
        memset(&desc, 0, sizeof desc);
        desc.time_step = 1e-4, desc.gravity = vec(0, -9.81);
        const scene s = open_scene(&desc, &stone);
        const dem2d_shape_id disc = give_shape(&s, make_disc(0.03));
        (void)add_floor(&s);
        dem2d_vec sum = vec(0, 0);
        for (int i = 0; i < 30; i++) {
            dem2d_particle_desc grain = grain_desc(&s, disc, 1, vec(0.05 * (i % 3), 0.05 * i));
            if (k > 0) grain.name = k == 1 ? (uint64_t)(i + 1) : 99;
            (void)add_grain(&s, &grain);
        }
        step(&s, 2000);
        dem2d_particle_id ids[30];
        int count;
        assert_ok(dem2d_world_particles(s.world, ids, 30, &count));
        hash[k] = 0;
        for (int i = 0; i < 30; i++) {
            const dem2d_particle_info info = grain_of(&s, ids[i]);
            uint64_t bits;
            sum = info.pose.position;
            memcpy(&bits, &sum.x, sizeof bits), hash[k] = hash[k] * 31 + bits;
            memcpy(&bits, &sum.y, sizeof bits), hash[k] = hash[k] * 31 + bits;
        }
        close_scene(&s);
    }
    assert_true(hash[0] == hash[1] && hash[0] == hash[2]);
}

/* A name that comes late finds the others in the order of their ids. */
static void test_late_name(void **state) {
    (void)state;
    pile p, q;
    make_pile(&p, SHAPES, (order){0, false, 0});
    make_pile(&q, SHAPES, (order){0, false, 0});
    step(&p.s, STEPS), step(&q.s, STEPS);
    q.how.named = true;
    add_grains(&p, GRAINS, GRAINS + LATE);
    add_grains(&q, GRAINS, GRAINS + LATE);
    assert_true(inside_holds(q.s.world));
    step(&q.s, 1);
    assert_true(inside_holds(q.s.world));
    const dem2d_particle_info a = grain_of(&q.s, q.grains[0]);
    const dem2d_particle_info b = grain_of(&q.s, q.grains[GRAINS]);
    assert_true(a.name == 0 && b.name == name_of(GRAINS));
    close_scene(&p.s), close_scene(&q.s);
}

/* The first name when there are more ids than particles. */
static void test_name_after_removals(void **state) {
    (void)state;
    pile p;
    make_pile(&p, RUBBING, (order){0, false, 0});
    step(&p.s, 10);
    for (int i = 0; i < GRAINS - 3; i++)
        assert_ok(dem2d_world_remove_particle(p.s.world, p.grains[i]));
    step(&p.s, 10);
    dem2d_particle_desc grain = grain_desc(&p.s, p.shapes[0], 1, vec(0.2, 0.2));
    grain.name = 5;
    (void)add_grain(&p.s, &grain);
    assert_true(inside_holds(p.s.world));
    step(&p.s, 10);
    assert_true(inside_holds(p.s.world));
    close_scene(&p.s);
}

/* In the middle, after an edit whose order is not found yet. */
static void test_snapshot(void **state) {
    (void)state;
    pile p, q;
    make_pile(&p, SHAPES, (order){7, true, 0});
    step(&p.s, STEPS);
    edit_pile(&p);
    for (int k = 0; k < 2; k++) {
        scene_bytes bytes = scene_save(p.s.world);
        q = p;
        q.s = scene_load(&p.s, &bytes);
        free(bytes.bytes);
        assert_true(inside_holds(q.s.world));
        assert_true(dem2d_world_hash(q.s.world) == dem2d_world_hash(p.s.world));
        assert_true(piles_agree(&p, &q));
        step(&p.s, STEPS / 3), step(&q.s, STEPS / 3);
        assert_true(dem2d_world_hash(q.s.world) == dem2d_world_hash(p.s.world));
        assert_true(piles_agree(&p, &q));
        close_scene(&q.s);
    }
    close_scene(&p.s);
}

/* After a step that is refused when it has found the order and listed pairs by it. */
static void test_snapshot_of_refused(void **state) {
    (void)state;
    pile p, q;
    make_pile(&p, SHAPES, (order){7, true, 0});
    step(&p.s, STEPS);
    edit_pile(&p);
    assert_ok(dem2d_world_set_time_step(p.s.world, 1));
    assert_result(dem2d_world_step(p.s.world, 1, NULL), DEM2D_TIME_STEP);
    assert_true(inside_holds(p.s.world));
    scene_bytes bytes = scene_save(p.s.world);
    q = p;
    q.s = scene_load(&p.s, &bytes);
    free(bytes.bytes);
    assert_true(inside_holds(q.s.world));
    assert_true(piles_agree(&p, &q));
    for (int k = 0; k < 2; k++) {
        scene *s = k ? &q.s : &p.s;
        assert_ok(dem2d_world_set_time_step(s->world, 2e-4));
        step(s, STEPS / 3);
    }
    assert_true(dem2d_world_hash(q.s.world) == dem2d_world_hash(p.s.world));
    assert_true(piles_agree(&p, &q));
    close_scene(&p.s), close_scene(&q.s);
}

/* A name is part of the state; a wall that is set again may get another one. */
static void test_hash(void **state) {
    (void)state;
    pile p;
    make_pile(&p, RUBBING, (order){0, true, 0});
    step(&p.s, 200);
    const uint64_t before = dem2d_world_hash(p.s.world);
    dem2d_wall_desc wall = wall_desc(&p, 0);
    wall.name++;
    assert_ok(dem2d_world_set_wall(p.s.world, p.walls[0], &wall));
    assert_true(dem2d_world_hash(p.s.world) != before);
    wall.name = ~(uint64_t)0;
    assert_ok(dem2d_world_set_wall(p.s.world, p.walls[0], &wall));
    assert_true(wall_of(&p.s, p.walls[0]).name == ~(uint64_t)0);
    step(&p.s, 200);
    assert_true(inside_holds(p.s.world));
    close_scene(&p.s);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_shuffled),
                                       cmocka_unit_test(test_unnamed),
                                       cmocka_unit_test(test_same_order),
                                       cmocka_unit_test(test_late_name),
                                       cmocka_unit_test(test_name_after_removals),
                                       cmocka_unit_test(test_snapshot),
                                       cmocka_unit_test(test_snapshot_of_refused),
                                       cmocka_unit_test(test_hash)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
