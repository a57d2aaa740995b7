/* The periodic cell: a state in it is that with copies made by hand, whatever is listed, wherever
   the border is, and however small the cell is. The oracle is a world without a cell, in which each
   grain has copies at all cell vectors nearby; they get its forces. */
#include "dem2d.h"
#include "cell_grains.h"
#include "inside.h"

enum { GRAINS = 64, COPIES = 17 * 17 };

/* What fills a cell. */
typedef struct filling {
    int grains, kinds; /* 1: discs, 4: and other shapes */
    double solid;      /* area of the circles of diameter 1 over that of the cell */
    double speed;
    bool damped, walls; /* walls: not periodic along b */
    int around;         /* copies by hand: from -around to around cells */
} filling;

typedef struct packed {
    scene s;
    int count, copies;
    dem2d_vec a, b;
    dem2d_particle_id ids[GRAINS];
} packed;

/* Copies get the sums of their grain, the one in the middle of its ids. */
static void share(void *user, dem2d_sums *sums) {
    const packed *p = user;
    for (int i = 0; i < p->count; i++)
        for (int k = 0; k < p->copies; k++) {
            const int row = i * p->copies + k, own = i * p->copies + p->copies / 2;
            sums->force[row] = sums->force[own], sums->torque[row] = sums->torque[own];
        }
}

static void add_walls(const packed *p) {
    (void)add_plane(&p->s, 0, 0, 0, 1);
    (void)add_plane(&p->s, 0, p->b.y, 0, -1);
}

/* In a cell, or with copies by hand; desc has what both worlds shall have. */
static void fill(packed *p, const filling *f, const dem2d_world_desc *desc, bool cell) {
    const double area = f->grains * (double)TEST_PI / 4 / f->solid, side = sqrt(area);
    const int up = f->walls ? 0 : f->around;
    dem2d_world_desc made = *desc;
    dem2d_shape_id shapes[4];
    const dem2d_material_desc soft = soft_desc(f->damped);
    uint64_t random = 7;
    memset(p, 0, sizeof *p);
    p->a = vec(side, 0), p->b = f->walls ? vec(0, side) : vec(side / 4, side);
    p->count = f->grains, p->copies = cell ? 1 : (2 * f->around + 1) * (2 * up + 1);
    assert_true(f->grains <= GRAINS && p->copies <= COPIES);
    made.time_step = DT;
    if (cell) made.cell.a = p->a, made.cell.b = f->walls ? vec(0, 0) : p->b;
    if (!cell) made.gather = share, made.exchange_user = p;
    p->s = open_scene(&made, &soft);
    make_shapes(&p->s, shapes);
    if (f->walls) add_walls(p);
    const lattice at = {f->grains, f->kinds, f->speed, p->a, p->b};
    for (int i = 0; i < f->grains; i++) {
        const dem2d_particle_desc grain = grain_at(&p->s, &at, shapes, i, &random);
        for (int n = cell ? 0 : -up; n <= (cell ? 0 : up); n++)
            for (int m = cell ? 0 : -f->around; m <= (cell ? 0 : f->around); m++) {
                dem2d_particle_desc copy = grain;
                copy.position.x += m * p->a.x + n * p->b.x, copy.position.y += n * p->b.y;
                const dem2d_particle_id id = add_grain(&p->s, &copy);
                if (n == 0 && m == 0) p->ids[i] = id;
            }
    }
}

/* From one position to another, less whole cell vectors. */
static dem2d_vec apart(const packed *p, dem2d_vec from, dem2d_vec to) {
    dem2d_vec d = vec(to.x - from.x, to.y - from.y);
    const double n = rint(d.y / p->b.y);
    d.x -= n * p->b.x, d.y -= n * p->b.y;
    d.x -= rint(d.x / p->a.x) * p->a.x;
    return d;
}

/* The greatest distance of the same grains of two worlds; speeds and turns are as near. */
static double difference(const packed *p, const packed *q) {
    double most = 0;
    for (int i = 0; i < p->count; i++) {
        const dem2d_particle_info a = grain_of(&p->s, p->ids[i]), b = grain_of(&q->s, q->ids[i]);
        const dem2d_vec d = apart(p, a.pose.position, b.pose.position);
        most = fmax(most, hypot(d.x, d.y));
        most = fmax(most, fabs(a.pose.rotation.s - b.pose.rotation.s) / 2);
        most = fmax(most, hypot(a.velocity.x - b.velocity.x, a.velocity.y - b.velocity.y) / 32);
    }
    return most;
}

/* --- copies by hand --------------------------------------------------------------------------- */

static void test_copies(void **state) {
    (void)state;
    static const struct {
        filling f;
        int steps;
    } cases[] = {
        {{64, 1, 0.95, 0.25, false, false, 1}, 1000}, {{64, 4, 0.95, 0.25, true, false, 1}, 300},
        {{3, 1, 0.95, 0.25, true, false, 3}, 1000},   {{3, 4, 0.95, 0.25, false, false, 3}, 400},
        {{2, 1, 0.95, 0.25, true, false, 3}, 1000},   {{2, 4, 1.5, 0.1, true, false, 4}, 400},
        {{1, 1, 0.95, 0.1, true, false, 4}, 1000},    {{1, 1, 4, 0.1, true, false, 6}, 400},
        {{2, 1, 8, 0.1, false, false, 8}, 100},       {{16, 4, 0.8, 0.25, true, true, 2}, 1000},
    };
    const dem2d_world_desc plain = {0};
    for (int k = 0; k < COUNT_OF(cases); k++) {
        static packed cell, copies;
        fill(&cell, &cases[k].f, &plain, true), fill(&copies, &cases[k].f, &plain, false);
        int closed = 0;
        for (int i = 0; i < cases[k].steps; i += 50) {
            step(&cell.s, 50), step(&copies.s, 50);
            assert_true(inside_holds(cell.s.world));
            closed += stats_of(&cell.s).contacts;
        }
        print_message("case %d: %.2g\n", k, difference(&cell, &copies));
        assert_between(difference(&cell, &copies), 0, 1e-9);
        assert_true(closed > 0 || cases[k].f.grains == 1);
        close_scene(&cell.s), close_scene(&copies.s);
    }
}

/* --- what must not matter --------------------------------------------------------------------- */

/* A gas, in which many particles cross the border. */
static const filling gas = {40, 4, 0.6, 3, true, false, 0};

/* Not the skin, not when the list is made, not the order in memory, not threads; events neither. */
static void test_independent(void **state) {
    (void)state;
    static const double skins[] = {0, 0.004, 0.1, 0.4};
    static packed p[6];
    static dem2d_contact_event events[2][4096];
    int threads = 3, count[2];
    for (int k = 0; k < COUNT_OF(p); k++) {
        dem2d_world_desc desc = {0};
        desc.skin = skins[k % 4], desc.event_capacity = COUNT_OF(events[0]), desc.ledger = true;
        if (k == 5) desc.parallel_for = run_parts, desc.parallel_user = &threads;
        fill(&p[k], &gas, &desc, true);
        for (int i = 0; i < 600; i++) {
            if (k == 4) inside_scatter(p[k].s.world, i % 3 == 0);
            if (k == 4 && i % 5 == 0) inside_renew_list(p[k].s.world);
            step(&p[k].s, 1);
            if (i % 20 == 0) assert_true(inside_holds(p[k].s.world));
        }
        assert_true(dem2d_world_hash(p[k].s.world) == dem2d_world_hash(p[0].s.world));
        assert_ok(dem2d_world_events(p[k].s.world, events[k > 0], COUNT_OF(events[0]),
                                     &count[k > 0], NULL));
        assert_true(count[0] > 60);
        assert_int_equal(count[k > 0], count[0]);
        for (int i = 0; i < count[0] && k > 0; i++) {
            assert_true(events[0][i].a.index == events[1][i].a.index);
            assert_true(events[0][i].b.index == events[1][i].b.index);
            assert_true(events[0][i].step == events[1][i].step);
            assert_same_bits(events[0][i].impulse, events[1][i].impulse);
        }
    }
    assert_true(stats_of(&p[1].s).list_rebuilds > 3 * stats_of(&p[3].s).list_rebuilds);
    for (int k = 0; k < COUNT_OF(p); k++) close_scene(&p[k].s);
}

/* A run that stops and goes on at any step, with what is around the border then. */
static void test_snapshots(void **state) {
    (void)state;
    static packed p;
    const dem2d_world_desc plain = {0};
    fill(&p, &gas, &plain, true);
    for (int i = 0; i < 40; i++) {
        step(&p.s, i);
        scene_bytes bytes = scene_save(p.s.world);
        const scene other = scene_load(&p.s, &bytes);
        scene_bytes again = scene_save(other.world);
        assert_true(inside_holds(other.world));
        assert_true(dem2d_world_hash(p.s.world) == dem2d_world_hash(other.world));
        step(&p.s, 10), step(&other, 10);
        assert_true(dem2d_world_hash(p.s.world) == dem2d_world_hash(other.world));
        assert_true(stats_of(&p.s).list_rebuilds == stats_of(&other).list_rebuilds);
        close_scene(&other), free(bytes.bytes), free(again.bytes);
    }
    close_scene(&p.s);
}

/* Grains that are put a few cells away are the same grains: bits, as the numbers are dyadic. */
static void test_moved_by_cells(void **state) {
    (void)state;
    uint64_t hash = 0;
    for (int k = 0; k < 4; k++) {
        const dem2d_material_desc soft = soft_desc(true);
        dem2d_world_desc desc = {0};
        desc.time_step = DT, desc.cell.a = vec(4, 0), desc.cell.b = vec(1, 8);
        desc.cell.origin = vec(-0.5, 0.25);
        const scene s = open_scene(&desc, &soft);
        dem2d_shape_id shapes[4];
        make_shapes(&s, shapes);
        for (int i = 0; i < 32; i++) {
            dem2d_particle_desc grain = grain_desc(&s, shapes[i % 4], 1, vec(i % 4, i / 4));
            const int m = k == 0 ? 0 : i % (k + 2) - k, n = k == 0 ? 0 : i % 5 - 2;
            grain.position.x += 4 * m + n, grain.position.y += 8 * n;
            grain.angle = i, grain.velocity = vec(sin(i), cos(i));
            (void)add_grain(&s, &grain);
        }
        step(&s, 300);
        if (k == 0) hash = dem2d_world_hash(s.world);
        assert_true(stats_of(&s).contacts > 16);
        assert_true(dem2d_world_hash(s.world) == hash);
        close_scene(&s);
    }
}

/* The lattice is the same with b + a, and with its corner elsewhere. */
static void test_other_cells(void **state) {
    (void)state;
    static packed p[3];
    const filling slow = {64, 4, 1, 0.1, true, false, 0};
    for (int k = 0; k < 3; k++) {
        dem2d_world_desc desc = {0};
        fill(&p[k], &slow, &desc, true);
        assert_ok(dem2d_world_get_desc(p[k].s.world, &desc));
        if (k == 1) desc.cell.b.x += 2 * desc.cell.a.x;
        if (k == 2) desc.cell.origin = vec(0.3, 7.1);
        const packed old = p[k];
        const dem2d_material_desc soft = soft_desc(true);
        dem2d_shape_id shapes[4];
        p[k].s = open_scene(&desc, &soft);
        make_shapes(&p[k].s, shapes);
        for (int i = 0; i < old.count; i++) {
            dem2d_particle_desc grain;
            assert_ok(dem2d_world_get_particle_desc(old.s.world, old.ids[i], &grain));
            p[k].ids[i] = add_grain(&p[k].s, &grain);
        }
        close_scene(&old.s);
    }
    for (int k = 0; k < 3; k++) step(&p[k].s, 400);
    assert_true(stats_of(&p[0].s).contacts > 20);
    for (int k = 1; k < 3; k++) assert_between(difference(&p[0], &p[k]), 0, 1e-12);
    for (int k = 0; k < 3; k++) close_scene(&p[k].s);
}

/* --- closed forms ----------------------------------------------------------------------------- */

/* A disc that touches six images of itself: three contacts, p = sqrt(3) f/d. */
static void test_lattice(void **state) {
    (void)state;
    const double d = 0.97, root = sqrt(3.0), force = KN * (1 - d);
    const dem2d_material_desc soft = soft_desc(false);
    static const int shifts[3][2] = {{1, 0}, {-1, 1}, {0, 1}};
    dem2d_contact_info contacts[4];
    dem2d_world_desc desc = {0};
    dem2d_stress stress;
    desc.time_step = DT, desc.cell.a = vec(d, 0), desc.cell.b = vec(d / 2, d * root / 2);
    const scene s = open_scene(&desc, &soft);
    const dem2d_particle_desc grain =
        grain_desc(&s, give_shape(&s, make_disc(0.5)), 1, vec(5.1, -3.3));
    const dem2d_particle_id id = add_grain(&s, &grain);
    step(&s, 10);
    assert_int_equal(contacts_of(&s, contacts, 4), 3);
    for (int k = 0; k < 3; k++) {
        bool there = false;
        assert_near(contacts[k].normal_force, force, 1e-12);
        assert_int_equal(contacts[k].a.index, contacts[k].b.index);
        for (int i = 0; i < 3; i++)
            there |= contacts[i].shift[0] == shifts[k][0] && contacts[i].shift[1] == shifts[k][1];
        assert_true(there);
    }
    assert_ok(dem2d_world_stress(s.world, d * d * root / 2, &stress));
    assert_near(stress.xx, root * contacts[0].normal_force / d, 1e-14);
    assert_near(stress.yy, root * contacts[0].normal_force / d, 1e-14);
    assert_within(stress.xy, 0, 1e-14 * stress.xx);
    assert_ok(dem2d_world_particle_stress(s.world, id, &stress));
    assert_near(stress.xx * (double)TEST_PI / 4 / (d * d * root / 2), root * force / d, 1e-12);
    assert_near(packing_of(&s).coordination, 6, 1e-15);
    int own;
    assert_ok(dem2d_world_particle_contacts(s.world, id, contacts, 4, &own));
    assert_int_equal(own, 3);
    const dem2d_box region = {{0, 0}, {d, d * root / 2}};
    double porosity;
    assert_ok(dem2d_world_porosity(s.world, &region, &porosity));
    assert_true(porosity < 0.16); /* images count: overlaps count twice */
    assert_near(energy_of(&s).normal, 3 * force * force / KN / 2, 1e-12);
    close_scene(&s);
}

/* A region as large as the cell has the same solid area wherever it is. */
static void test_porosity(void **state) {
    (void)state;
    static packed p;
    const filling dilute = {64, 4, 0.6, 0, false, false, 0};
    const dem2d_world_desc plain = {0};
    fill(&p, &dilute, &plain, true);
    const double solid = packing_of(&p.s).solid_area, area = p.a.x * p.b.y;
    for (int k = 0; k < 5; k++) {
        const dem2d_vec at = vec(0.37 * k, -1.3 * k);
        const dem2d_box region = {at, {at.x + p.a.x, at.y + p.b.y}};
        const dem2d_box four = {at, {at.x + 2 * p.a.x, at.y + 2 * p.b.y}};
        double porosity, larger;
        assert_ok(dem2d_world_porosity(p.s.world, &region, &porosity));
        assert_ok(dem2d_world_porosity(p.s.world, &four, &larger));
        assert_within(porosity, 1 - solid / area, 1e-12);
        assert_within(larger, 1 - solid / area, 1e-12);
    }
    close_scene(&p.s);
}

/* A grid with the periods of the cell has its sums, and the contacts across the border, also when
   along x it gets the images; other periods are refused. */
static void test_grid(void **state) {
    (void)state;
    const dem2d_material_desc soft = soft_desc(false);
    dem2d_world_desc desc = {0};
    dem2d_stress stress;
    desc.time_step = DT, desc.cell.a = vec(4, 0), desc.cell.b = vec(0, 3);
    const scene s = open_scene(&desc, &soft);
    const dem2d_shape_id disc = give_shape(&s, make_disc(0.51));
    for (int i = 0; i < 12; i++) {
        const dem2d_particle_desc grain = grain_desc(&s, disc, 1, vec(i % 4, i / 4 + 0.3));
        (void)add_grain(&s, &grain);
    }
    step(&s, 1);
    assert_ok(dem2d_world_stress(s.world, 12, &stress));
    for (int k = 0; k < 4; k++) {
        dem2d_grid_desc made = {0};
        dem2d_grid *grid;
        dem2d_average cells[6];
        int count;
        made.box.lower = vec(-0.7, 0.2), made.box.upper = vec(3.3, 3.2), made.nx = 3, made.ny = 2;
        made.periodic_x = k != 1, made.periodic_y = true, made.width_x = made.width_y = 0.8;
        if (k == 2) made.box.upper.x = 3.4;
        if (k == 3) made.angle = 0.1;
        assert_ok(dem2d_grid_create(NULL, &made, &grid));
        assert_result(dem2d_grid_add(grid, s.world, 1), k < 2 ? DEM2D_OK : DEM2D_OUT_OF_RANGE);
        assert_ok(dem2d_grid_read(grid, cells, 6, &count));
        double mass = 0, xx = 0, yy = 0;
        for (int i = 0; i < count; i++)
            mass += cells[i].density * 2, xx += cells[i].contact.xx / 6,
                yy += cells[i].contact.yy / 6;
        if (k < 2) assert_near(mass, 12 * 4 * 0.51 * 0.51, 1e-12);
        if (k < 2) assert_near(xx, stress.xx, 1e-12);
        if (k < 2) assert_near(yy, stress.yy, 1e-12);
        dem2d_grid_destroy(grid);
    }
    close_scene(&s);
}

/* Momentum stays, and energy as far as the ledger says. */
static void test_conserved(void **state) {
    (void)state;
    static packed p;
    dem2d_world_desc desc = {0};
    desc.ledger = true;
    fill(&p, &gas, &desc, true);
    dem2d_vec start = vec(0, 0), end = vec(0, 0);
    double size = 0;
    for (int k = 0; k < 2; k++) {
        dem2d_vec *sum = k == 0 ? &start : &end;
        for (int i = 0; i < p.count; i++) {
            const dem2d_particle_info info = grain_of(&p.s, p.ids[i]);
            sum->x += info.mass * info.velocity.x, sum->y += info.mass * info.velocity.y;
            if (k == 0) size += info.mass * hypot(info.velocity.x, info.velocity.y);
        }
        if (k == 0) step(&p.s, 2000);
    }
    assert_within(end.x, start.x, 1e-13 * size);
    assert_within(end.y, start.y, 1e-13 * size);
    const dem2d_ledger ledger = ledger_of(&p.s);
    assert_true(ledger.turnover > 10);
    assert_within(ledger.closure, 0, 1e-2 * ledger.turnover);
    close_scene(&p.s);
}

/* --- edits ------------------------------------------------------------------------------------ */

/* One edit of many kinds, the same in each world. */
static void edit(packed *p, int round, uint64_t *random) {
    dem2d_world *world = p->s.world;
    const int i = (int)random_between(random, 0, p->count), kind = round % 7;
    const dem2d_vec at = vec(random_between(random, -20, 20), random_between(random, -20, 20));
    const double speed = random_between(random, -2, 2);
    dem2d_particle_desc desc;
    assert_ok(dem2d_world_get_particle_desc(world, p->ids[i], &desc));
    if (kind == 0) {
        assert_ok(dem2d_world_remove_particle(world, p->ids[i]));
        desc.position = at;
        p->ids[i] = add_grain(&p->s, &desc);
    } else if (kind == 1) {
        assert_ok(dem2d_world_move_particle(world, p->ids[i], at, speed));
    } else if (kind == 2) {
        set_velocity(&p->s, p->ids[i], DEM2D_FREE, vec(speed, -speed), speed);
    } else if (kind == 3) {
        assert_ok(dem2d_world_set_shape(world, p->ids[i], desc.shape, 0.8 + fabs(speed) / 10));
    } else if (kind == 4) {
        const dem2d_groups groups = {1u << round % 3, speed > 0 ? 3u : 0u, false};
        assert_ok(dem2d_world_set_groups(world, p->ids[i], groups));
    } else if (kind == 5) {
        const dem2d_motion motion = round % 2 ? DEM2D_DRIVEN : DEM2D_FIXED;
        const double v = motion == DEM2D_FIXED ? 0 : speed;
        set_velocity(&p->s, p->ids[i], motion, vec(v, v), v);
    } else {
        for (int k = 0; k < 3; k++) (void)add_grain(&p->s, &desc); /* they overlap, and part */
    }
}

static void test_edits(void **state) {
    (void)state;
    static packed p[2];
    const filling slow = {40, 4, 0.5, 1, true, false, 0};
    for (int k = 0; k < 2; k++) {
        dem2d_world_desc desc = {0};
        uint64_t random = 3;
        desc.skip_time_step_check = true;
        fill(&p[k], &slow, &desc, true);
        for (int round = 0; round < 150; round++) {
            step(&p[k].s, 1 + round % 4);
            edit(&p[k], round, &random);
            if (round % 3 == 0) edit(&p[k], round + 11, &random);
            dem2d_energy energy = energy_of(&p[k].s); /* reads all contacts */
            assert_true(energy.normal >= 0);
            if (k == 1) inside_renew_list(p[k].s.world);
            assert_true(inside_holds(p[k].s.world));
        }
    }
    assert_true(dem2d_world_hash(p[0].s.world) == dem2d_world_hash(p[1].s.world));
    for (int k = 0; k < 2; k++) close_scene(&p[k].s);
}

/* No memory at any point: the run goes on to the same bits when there is some again. */
static void test_memory(void **state) {
    (void)state;
    uint64_t hash = 0;
    int failed = 0;
    for (int call = 0; call < 60; call++) {
        static packed p;
        test_env env;
        test_env_init(&env);
        dem2d_world_desc desc = {0};
        desc.env = &env.env;
        fill(&p, &gas, &desc, true);
        test_env_fail(&env, call);
        failed += test_steps_fail(p.s.world, 150);
        if (call == 0) hash = dem2d_world_hash(p.s.world);
        assert_true(dem2d_world_hash(p.s.world) == hash);
        close_scene(&p.s);
        assert_clean(&env);
    }
    assert_true(failed > 5);
}

static bool refuses;

static dem2d_result refuse(void *user, dem2d_result result) {
    (void)user;
    return refuses ? DEM2D_STATE : result;
}

/* A disc that leaves the cell and has a partner finds no memory for its way back: it goes back in the
   next step, also if this is refused, and the hash stays the same. */
static void test_late_wrap(void **state) {
    (void)state;
    bool late = false;
    for (int call = 1, refused = 1; refused > 0 && !late; call++) {
        const dem2d_material_desc soft = soft_desc(false);
        dem2d_world_desc desc = {0};
        test_env env;
        test_env_init(&env);
        desc.env = &env.env, desc.commit = refuse;
        desc.time_step = DT, desc.cell.a = vec(40, 0), desc.cell.b = vec(0, 40);
        const scene s = open_scene(&desc, &soft);
        const dem2d_shape_id disc = give_shape(&s, make_disc(0.5));
        dem2d_particle_id ids[2];
        for (int i = 0; i < 2; i++) {
            dem2d_particle_desc grain = grain_desc(&s, disc, 1, vec(0.05 + 0.9 * i, 20));
            grain.velocity.x = -0.1 / DT;
            ids[i] = add_grain(&s, &grain);
        }
        test_env_fail(&env, call);
        refused = test_steps_fail(s.world, 1);
        late = refused == 0 && grain_of(&s, ids[0]).pose.position.x < 0;
        const uint64_t hash = dem2d_world_hash(s.world);
        refuses = true;
        assert_result(dem2d_world_step(s.world, 1, NULL), DEM2D_STATE);
        refuses = false;
        assert_true(dem2d_world_hash(s.world) == hash);
        close_scene(&s);
        assert_clean(&env);
    }
    assert_true(late);
}

/* --- walls, and what is refused ---------------------------------------------------------------- */

/* Grains in a shear cell: servo wall above, floor below, periodic along x. */
static void test_servo(void **state) {
    (void)state;
    static packed p;
    const filling layer = {48, 1, 0.7, 0.5, true, true, 0};
    const dem2d_world_desc plain = {0};
    dem2d_wall_id walls[2];
    int count;
    fill(&p, &layer, &plain, true);
    assert_ok(dem2d_world_walls(p.s.world, walls, 2, &count));
    dem2d_wall_desc top = plane_desc(&p.s, vec(0, p.b.y), vec(0, -1));
    top.mode = DEM2D_WALL_SERVO, top.stress = 10, top.max_speed = 0.5, top.length = p.a.x;
    assert_ok(dem2d_world_set_wall(p.s.world, walls[1], &top));
    assert_ok(dem2d_world_set_damping(p.s.world, 0.3, 0));
    step(&p.s, 20000);
    assert_near(wall_of(&p.s, walls[1]).stress, 10, 1e-2);
    assert_near(-wall_of(&p.s, walls[0]).force.y / p.a.x, 10, 1e-2);
    assert_true(inside_holds(p.s.world));
    close_scene(&p.s);
}

/* Two discs in contact across the border that are more than a metre apart after the next step: a gap
   of a pair is no passage of a wall, whatever the unit of length. */
static void test_flung(void **state) {
    (void)state;
    const dem2d_material_desc soft = soft_desc(false);
    dem2d_world_desc desc = {0};
    desc.time_step = DT, desc.cell.a = vec(40, 0), desc.cell.b = vec(0, 40);
    const scene s = open_scene(&desc, &soft);
    const dem2d_shape_id disc = give_shape(&s, make_disc(0.5));
    for (int i = 0; i < 2; i++) {
        dem2d_particle_desc grain = grain_desc(&s, disc, 1, vec(i ? 39.6 : 0.5, 20));
        grain.velocity.x = (i ? -3 : 3) / DT;
        (void)add_grain(&s, &grain);
    }
    for (int k = 0; k < 4; k++) {
        step(&s, 1);
        assert_true(inside_holds(s.world));
    }
    close_scene(&s);
}

/* Two discs in contact across the border, and one as far away as it can be where the cell is not
   periodic: it needs no more images than any other. */
static void test_far_away(void **state) {
    (void)state;
    static const double places[] = {1e6, 1e16, 1e20, 1e100, 1e300};
    for (int k = 0; k < 4 * COUNT_OF(places); k++) {
        const bool along_a = k % 2;
        const double far = (k & 2 ? -1 : 1) * places[k / 4];
        const dem2d_material_desc soft = soft_desc(false);
        dem2d_world_desc desc = {0};
        test_env env;
        test_env_init(&env);
        desc.env = &env.env, desc.time_step = DT;
        *(along_a ? &desc.cell.a.x : &desc.cell.b.y) = 4;
        const scene s = open_scene(&desc, &soft);
        const dem2d_shape_id disc = give_shape(&s, make_disc(0.5));
        for (int i = 0; i < 3; i++) {
            const double along = i ? 3.7 : 0.3, across = i == 2 ? far : 0;
            const dem2d_vec at = along_a ? vec(along, across) : vec(across, along);
            const dem2d_particle_desc grain = grain_desc(&s, disc, 1, at);
            (void)add_grain(&s, &grain);
        }
        step(&s, 3);
        dem2d_contact_info contact;
        assert_int_equal(contacts_of(&s, &contact, 1), 1);
        assert_true(inside_holds(s.world) && env.peak < 1 << 20);
        close_scene(&s);
        assert_clean(&env);
    }
}

static void expect_refused_cell(dem2d_vec a, dem2d_vec b, const char *word) {
    test_env env;
    dem2d_world_desc desc = {0};
    dem2d_world *world = NULL;
    test_env_init(&env);
    desc.time_step = 1, desc.env = &env.env, desc.cell.a = a, desc.cell.b = b;
    assert_result(dem2d_world_create(&desc, &world), DEM2D_OUT_OF_RANGE);
    assert_logged(&env, DEM2D_OUT_OF_RANGE, -1, word);
    assert_true(world == NULL);
    assert_clean(&env);
}

static void test_refused(void **state) {
    (void)state;
    expect_refused_cell(vec(1, 0.1), vec(0, 1), "a");
    expect_refused_cell(vec(-1, 0), vec(0, 1), "a");
    expect_refused_cell(vec(1, 0), vec(0, -1), "b");
    expect_refused_cell(vec(1, 0), vec(1, 0), "b");
    expect_refused_cell(vec(1, 0), vec(0, 1e-320), "cell");
    expect_refused_cell(vec(1, 0), vec(-1025, 1), "leans");
    expect_refused_cell(vec(2, 0), vec(0, 2.2e9), "2^30");
    for (int k = 0; k < 3; k++) { /* periodic along x, along b, along both */
        const dem2d_material_desc soft = soft_desc(false);
        dem2d_world_desc desc = {0};
        dem2d_wall_id wall;
        test_env env;
        test_env_init(&env);
        desc.time_step = DT, desc.env = &env.env;
        if (k != 1) desc.cell.a = vec(4, 0);
        if (k != 0) desc.cell.b = vec(1, 4);
        const scene s = open_scene(&desc, &soft);
        const dem2d_vec normals[2] = {{0, 1}, {4 / sqrt(17.0), -1 / sqrt(17.0)}};
        for (int i = 0; i < 2; i++) {
            const dem2d_wall_desc plane = plane_desc(&s, vec(0, 0), normals[i]);
            const dem2d_result right = k == i ? DEM2D_OK : DEM2D_OUT_OF_RANGE;
            assert_result(dem2d_world_add_wall(s.world, &plane, &wall), right);
        }
        if (k == 0) {
            assert_ok(dem2d_world_drive_wall(s.world, wall, vec(1, 0), 0));
            assert_result(dem2d_world_drive_wall(s.world, wall, vec(1, 0), 1), DEM2D_OUT_OF_RANGE);
            assert_logged(&env, DEM2D_OUT_OF_RANGE, -1, "angular_velocity");
        }
        dem2d_particle_desc far =
            grain_desc(&s, give_shape(&s, make_disc(0.5)), 1, vec(1e10, 1e10));
        dem2d_particle_id id;
        assert_result(dem2d_world_add_particle(s.world, &far, &id), DEM2D_OUT_OF_RANGE);
        assert_logged(&env, DEM2D_OUT_OF_RANGE, -1, "position");
        far.position = vec(0.5, 0.5), far.scale = 130; /* a radius of 65 in a cell of 4 */
        assert_result(dem2d_world_add_particle(s.world, &far, &id), DEM2D_OUT_OF_RANGE);
        assert_logged(&env, DEM2D_OUT_OF_RANGE, -1, "a sixteenth of the radius");
        far.scale = 1;
        id = add_grain(&s, &far);
        assert_result(dem2d_world_set_shape(s.world, id, far.shape, 130), DEM2D_OUT_OF_RANGE);
        assert_result(dem2d_world_move_particle(s.world, id, vec(1e10, 1e10), 0),
                      DEM2D_OUT_OF_RANGE);
        assert_true(inside_holds(s.world));
        close_scene(&s);
        assert_clean(&env);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_copies),      cmocka_unit_test(test_independent),
        cmocka_unit_test(test_snapshots),   cmocka_unit_test(test_moved_by_cells),
        cmocka_unit_test(test_other_cells), cmocka_unit_test(test_lattice),
        cmocka_unit_test(test_porosity),    cmocka_unit_test(test_grid),
        cmocka_unit_test(test_conserved),   cmocka_unit_test(test_edits),
        cmocka_unit_test(test_memory),      cmocka_unit_test(test_late_wrap),
        cmocka_unit_test(test_servo),       cmocka_unit_test(test_refused),
        cmocka_unit_test(test_flung),       cmocka_unit_test(test_far_away),
    };
    return cmocka_run_group_tests_name("periodic cell", tests, NULL, NULL);
}
