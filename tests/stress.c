/* stress [--quick] [CASE] - tries to break the solver: steps at their limit, ratios of stiffness,
   mass and size, speeds, overlaps, long runs, tall piles, needles, far places, units, changes in
   the middle of a run, jamming, servo walls; motion there and back, in turning frames, under load
   cycles and in its modes (stress_motion.h); slides over joined segments (stress_joints.h). Each
   row has a criterion that was fixed before it was first run; a row that fails stays, and is told.
   CASE: only those whose name begins so. Exit status: 0, 1 if a row failed, 2 for bad usage. */
#define DEM2D_IMPLEMENTATION
#include "dem2d.h"
#include "stress.h"
#include "stress_joints.h"
#include "stress_motion.h"

#include <time.h>

/* --- the time step at its limit -------------------------------------------------------------- */

/* A disc on a wall swings about its rest without leaving it. The leapfrog from rest has the
   amplitude 1/sqrt(1 - (w dt/2)^2) = 7.089 times the first. */
static void limit_of_one(void) {
    dem2d_world_desc d = {0};
    double safe, limit, most = 0;
    d.time_step = 1e-5, d.gravity.y = -9.81;
    stress_scene s = make_scene(&d, &glass);
    const dem2d_particle_id id = add(&s, DISC, 1, 0, 1, 0);
    const double sag = grain_of(&s.base, id).mass * 9.81 / glass.normal_stiffness;
    put_plane(&s, 0, 0, 0, 1);
    expect_ok(dem2d_world_move_particle(s.base.world, id, vec(0, 1 - sag), 0), "move");
    step(&s.base, 1);
    expect_ok(dem2d_world_time_step_bounds(s.base.world, &safe, &limit, NULL), "bounds");
    expect_ok(dem2d_world_set_time_step(s.base.world, 0.99 * limit), "time step");
    expect_ok(dem2d_world_move_particle(s.base.world, id, vec(0, 1 - 0.9 * sag), 0), "move");
    expect_ok(dem2d_world_drive_particle(s.base.world, id, DEM2D_FREE, vec(0, 0), 0), "drive");
    const int steps = quick ? 20000 : 1000000;
    for (int i = 0; i < steps; i++) {
        step(&s.base, 1);
        most = fmax(most, fabs(grain_of(&s.base, id).pose.position.y - (1 - sag)));
    }
    most /= 0.1 * sag;
    row(most < 7.1, "step: disc on a wall, 0.99 limit", "swings by at most 7.09 of the first",
        "%.4f", most);
    end_scene(&s);
}

/* 20 rows of 20 discs, overlapping by 1e-4 of their size, in a frame of fixed ones; small random
   velocities, so that no contact opens. Its stiffest mode has nearly 6 k/m. */
static stress_scene lattice(double part) {
    enum { SIDE = 22 };
    dem2d_world_desc d = {0};
    double safe, limit;
    d.time_step = 1e-6;
    stress_scene s = make_scene(&d, &glass);
    const double r = 0.01, gap = 2 * r * (1 - 1e-4), rise = gap * sqrt(0.75);
    const double v = 1e-7 * r * sqrt(glass.normal_stiffness / (glass.density * PI * r * r));
    for (int j = 0; j < SIDE; j++)
        for (int i = 0; i < SIDE; i++) {
            dem2d_particle_desc g = kind_desc(&s, DISC, 0, r, gap * (i + 0.5 * (j % 2)), rise * j);
            if (i == 0 || j == 0 || i == SIDE - 1 || j == SIDE - 1)
                g.motion = DEM2D_FIXED;
            else
                g.velocity = vec(uniform(-v, v), uniform(-v, v));
            add_desc(&s, &g);
        }
    step(&s.base, 1);
    expect_ok(dem2d_world_time_step_bounds(s.base.world, &safe, &limit, NULL), "bounds");
    expect_ok(dem2d_world_set_time_step(s.base.world, part * safe), "time step");
    return s;
}

/* The kinetic energy swings with the amplitude: at most 1/(1 - 0.99^2) = 50 times what it was. */
static void limit_of_many(void) {
    double most[2] = {0, 0};
    int64_t slow[2];
    for (int k = 0; k < 2; k++) {
        stress_scene s = lattice(k == 0 ? 0.99 : 1.02);
        const double first = kinetic_of(&s.base);
        const int steps = k == 1 ? 500 : quick ? 3000 : 50000;
        for (int i = 0; i < steps; i++) { /* what is unstable may come to be refused */
            if (dem2d_world_step(s.base.world, 1, NULL) != DEM2D_OK) break;
            most[k] = fmax(most[k], kinetic_of(&s.base) / first);
        }
        slow[k] = stats_of(&s.base).slow_time_step;
        end_scene(&s);
    }
    row(most[0] < 50 && slow[0] == 0, "step: lattice, 0.99 of safe",
        "not noted, kinetic energy at most 50 times", "%lld, %.3g times", (long long)slow[0],
        most[0]);
    row(most[1] > 100 && slow[1] > 0, "step: lattice, 1.02 of safe",
        "noted, kinetic energy above 100 times", "%lld, %.3g times", (long long)slow[1], most[1]);
}

/* A pile with friction at rest. */
static void limit_of_pile(void) {
    const dem2d_world_desc d = pile_desc();
    stress_scene s = make_pile(&d, &stone, 60, 6, 0, 0);
    double safe, limit;
    dem2d_particle_id worst;
    char name[32];
    step(&s.base, 60000);
    expect_ok(dem2d_world_time_step_bounds(s.base.world, &safe, &limit, &worst), "bounds");
    expect_ok(dem2d_world_set_time_step(s.base.world, 1.01 * limit), "time step");
    const uint64_t before = state_of(&s);
    const dem2d_result result = dem2d_world_step(s.base.world, 1, NULL);
    snprintf(name, sizeof name, "particle %u", (unsigned)worst.index);
    const bool named = log_of_world.result == DEM2D_TIME_STEP &&
                       log_of_world.index == (int)worst.index &&
                       strstr(log_of_world.text, name) != NULL;
    const bool same = state_of(&s) == before;
    row(result == DEM2D_TIME_STEP && named && same, "step: pile, 1.01 of the limit",
        "TIME_STEP, the particle named, the same bits", "%s, %s, %s",
        result == DEM2D_TIME_STEP ? "TIME_STEP" : dem2d_result_text(result),
        named ? "named" : "not named", same ? "same" : "changed");
    expect_ok(dem2d_world_set_time_step(s.base.world, 0.99 * safe), "time step");
    step(&s.base, quick ? 30000 : 200000);
    const dem2d_energy e = energy_of(&s.base);
    const double ratio = (e.translational + e.rotational) / (e.normal + e.tangential);
    row(ratio < 1e-3, "step: pile, 0.99 of safe", "kinetic below 1e-3 of the contact energy",
        "%.1e", ratio);
    end_scene(&s);
}

static void case_step(void) {
    limit_of_one();
    limit_of_many();
    limit_of_pile();
}

/* --- ratios ---------------------------------------------------------------------------------- */

/* Soft and hard discs by turns, 5 wide and 8 high, come to rest; the soft ones give by some
 * percent.
 */
static void case_stiffness(void) {
    const dem2d_material_desc soft = material_desc(10, 1e4, 1e4, 0.3),
                              hard = material_desc(10, 1e10, 1e10, 0.3);
    dem2d_world_desc d = {0};
    dem2d_material_id other;
    const double r = 0.1, mass = 10 * PI * r * r;
    d.time_step = 0.2 * sqrt(mass / hard.normal_stiffness);
    d.gravity.y = -9.81, d.local_damping = 0.5;
    stress_scene s = make_scene(&d, &soft);
    expect_ok(dem2d_world_add_material(s.base.world, &hard, &other), "material");
    for (int i = 0; i < 40; i++) {
        dem2d_particle_desc g = kind_desc(&s, DISC, 0, r, r * (1 + 2.05 * (i % 5)) + 0.01 * (i % 3),
                                          r * (1 + 2.05 * (i / 5)));
        if (i % 2) g.material = other;
        add_desc(&s, &g);
    }
    put_box(&s, 0, 0, 10.5 * r, 30 * r);
    step(&s.base, quick ? 2000000 : 6000000);
    const double share = floor_share(&s, 9.81, 1000);
    dem2d_packing p;
    expect_ok(dem2d_world_packing(s.base.world, &p), "packing");
    row(fabs(share - 1) < 1e-3 && all_finite(&s), "ratio of stiffness 1e6: pile",
        "floor carries the weight to 1e-3", "%.6f, overlaps to %.1f %%", share,
        100 * p.max_overlap);
    end_scene(&s);
}

/* A light disc against a heavy one at rest: v' = -v (1 - 2 m/M), to a part of 1e-3 at a 200th of
   the contact time; what the heavy one gets is the rest of the momentum. */
static void light_on_heavy(const dem2d_material_desc *heavy) {
    dem2d_world_desc d = {0};
    dem2d_material_id other;
    const double mass = glass.density * PI;
    d.time_step = contact_time(mass, glass.normal_stiffness, false) / 200;
    stress_scene s = make_scene(&d, &glass);
    expect_ok(dem2d_world_add_material(s.base.world, heavy, &other), "material");
    const dem2d_particle_id light = add(&s, DISC, 1, -2.0001, 0, 1);
    dem2d_particle_desc g = kind_desc(&s, DISC, 0, 1, 0, 0);
    g.material = other;
    const dem2d_particle_id large = add_desc(&s, &g);
    step(&s.base, 2000);
    const double v = grain_of(&s.base, light).velocity.x, V = grain_of(&s.base, large).velocity.x;
    const double momentum = mass * v + grain_of(&s.base, large).mass * V;
    row(fabs(v + 1) < 1e-3 && fabs(momentum / mass - 1) < 1e-12, "ratio of mass 1e9: impact",
        "v' = -v to 1e-3, momentum to 1e-12", "%.1e, %.1e", v + 1, momentum / mass - 1);
    end_scene(&s);
}

/* The heavy one squeezes the light one against a wall, and comes back as it came: the light one is
   a spring of half the stiffness. */
static void heavy_on_light(const dem2d_material_desc *heavy) {
    dem2d_world_desc d = {0};
    dem2d_material_id other;
    const double mass = glass.density * PI, large = heavy->density * PI;
    const double k = glass.normal_stiffness, v = 0.1 / sqrt(2 * large / k); /* overlaps of 5 % */
    d.time_step = contact_time(mass, k, true) / 50;
    stress_scene s = make_scene(&d, &glass);
    expect_ok(dem2d_world_add_material(s.base.world, heavy, &other), "material");
    put_plane(&s, 0, 0, 1, 0);
    add(&s, DISC, 1, 1, 0, 0);
    dem2d_particle_desc g = kind_desc(&s, DISC, 0, 1, 3, 0);
    g.material = other, g.velocity.x = -v;
    const dem2d_particle_id id = add_desc(&s, &g);
    step(&s.base, (int)(1.1 * PI * sqrt(2 * large / k) / d.time_step));
    const double back = grain_of(&s.base, id).velocity.x / v;
    row(fabs(back - 1) < 1e-3, "ratio of mass 1e9: squeeze", "comes back at its speed, to 1e-3",
        "%.1e", back - 1);
    end_scene(&s);
}

static void case_mass(void) {
    dem2d_material_desc heavy = glass;
    heavy.density *= 1e9;
    light_on_heavy(&heavy);
    heavy_on_light(&heavy);
}

/* Steps until no contact is open; false when that takes too long. */
static bool free_flight(stress_scene *s, int64_t *steps) {
    for (int i = 0; i < 200000; i++, ++*steps) {
        int open;
        expect_ok(dem2d_world_contacts(s->base.world, NULL, 0, &open), "contacts");
        if (open == 0) return true;
        step(&s->base, 1);
    }
    return false;
}

/* Greatest change of the energy, read where no contact is open. HUGE_VAL if one always is. */
static double drift(stress_scene *s, int64_t steps, int chunk) {
    double first = 0, worst = 0;
    int64_t done = 1;
    step(&s->base, 1);
    for (bool started = false; done < steps; started = true) {
        if (!free_flight(s, &done)) return HUGE_VAL;
        const double now = kinetic_of(&s->base);
        if (!started) first = now;
        worst = fmax(worst, fabs(now / first - 1));
        step(&s->base, chunk);
        done += chunk;
    }
    return worst;
}

static bool inside_box(const stress_scene *s, double side) {
    for (int i = 0; i < s->grain_count; i++) {
        const dem2d_vec x = grain_of(&s->base, s->grains[i]).pose.position;
        if (!(x.x > 0 && x.x < side && x.y > 0 && x.y < side)) return false;
    }
    return true;
}

/* A disc among 300 of a thousandth of its size, which fly against it. */
static void case_size(void) {
    dem2d_world_desc d = {0};
    const double r = 1e-3, mass = glass.density * PI * r * r;
    const double speed = 1e-3 * r * sqrt(glass.normal_stiffness / mass);
    d.time_step = contact_time(mass, glass.normal_stiffness, true) / 200;
    stress_scene s = make_scene(&d, &glass);
    add(&s, DISC, 1, 1.05, 1.05, 0);
    for (int i = 0; i < 300; i++) {
        const dem2d_rot q = dem2d_rot_make(2 * PI * i / 300 + 0.001);
        const double far = 1 + (1.2 + 0.2 * (i % 3)) * r;
        dem2d_particle_desc g = kind_desc(&s, DISC, 0, r, 1.05 + far * q.c, 1.05 + far * q.s);
        g.velocity = vec(-speed * q.c, -speed * q.s);
        add_desc(&s, &g);
    }
    put_box(&s, 0, 0, 2.1, 2.1);
    const int64_t steps = quick ? 60000 : 400000;
    const double worst = drift(&s, steps, 100);
    const bool in = inside_box(&s, 2.1);
    const dem2d_stats n = stats_of(&s.base);
    row(worst < 1e-4 && in && n.collisions > 0, "ratio of size 1e3: gas",
        "energy to 1e-4, none lost", "%.1e, %s; %d collisions", worst, in ? "none" : "LOST",
        (int)n.collisions);
    end_scene(&s);
}

/* --- speed and overlap ----------------------------------------------------------------------- */

/* Two discs head on, each by `part` of its radius in a step. */
static void meet(double part, bool *met, int64_t *fast, bool *named) {
    dem2d_world_desc d = {0};
    d.time_step = 1e-5;
    stress_scene s = make_scene(&d, &glass);
    const double v = part / d.time_step;
    add(&s, DISC, 1, -7.3, 0, v), add(&s, DISC, 1, 7.1, 0.1, -v);
    *met = false;
    for (int i = 0; i < (int)(20 / part) + 2; i++) {
        step(&s.base, 1);
        *met = *met || stats_of(&s.base).contacts > 0;
    }
    *fast = stats_of(&s.base).fast_motion;
    *named =
        log_of_world.count == 1 && log_of_world.result == DEM2D_WARNING && log_of_world.index == 0;
    end_scene(&s);
}

static void case_speed(void) {
    bool met, named;
    int64_t fast;
    meet(0.99, &met, &fast, &named);
    row(met && fast == 0, "speed: 0.99 radii in a step", "they meet; nothing is noted", "%s, %lld",
        met ? "met" : "missed", (long long)fast);
    meet(12.5, &met, &fast, &named);
    row(!met && fast > 0 && named, "speed: 12.5 radii in a step",
        "they miss each other; noted, and named once", "%s, %lld, %s", met ? "met" : "missed",
        (long long)fast, named ? "named" : "not named");
}

/* Two of a kind, nine tenths of their size in each other, are let go. Kinetic energy when they are
   apart, of that in the contact at first. */
static double released(int kind, int variant, double angle) {
    dem2d_world_desc d = {0};
    const double mass = glass.density * PI;
    d.time_step = contact_time(mass, glass.normal_stiffness, true) / 400;
    stress_scene s = make_scene(&d, &glass);
    const dem2d_rot q = dem2d_rot_make(angle);
    for (int i = 0; i < 2; i++) {
        const double x = i == 0 ? 0 : 0.2;
        dem2d_particle_desc g = kind_desc(&s, kind, variant, 1, x * q.c, x * q.s);
        g.angle = 1.3 * i * angle;
        add_desc(&s, &g);
    }
    double ratio = HUGE_VAL, stored = 0;
    for (int i = 0; i < 5000; i++) {
        if (dem2d_world_step(s.base.world, 1, NULL) != DEM2D_OK) break;
        const dem2d_energy e = energy_of(&s.base);
        if (i == 0) stored = e.normal;
        ratio = (e.translational + e.rotational) / stored;
        if (e.normal == 0) break;
    }
    end_scene(&s);
    return ratio;
}

/* Twelve of all kinds nearly at one place. */
static void heap(void) {
    dem2d_world_desc d = {0};
    d.time_step = contact_time(glass.density * PI, glass.normal_stiffness, true) / 400;
    stress_scene s = make_scene(&d, &glass);
    for (int i = 0; i < 12; i++) {
        dem2d_particle_desc g =
            kind_desc(&s, i % KINDS, i / KINDS, 1, uniform(-0.1, 0.1), uniform(-0.1, 0.1));
        g.angle = uniform(-3, 3);
        add_desc(&s, &g);
    }
    step(&s.base, 1);
    const double stored = energy_of(&s.base).normal;
    const dem2d_result result = dem2d_world_step(s.base.world, quick ? 5000 : 20000, NULL);
    const double ratio = kinetic_of(&s.base) / stored;
    row(result == DEM2D_OK && all_finite(&s) && ratio < 1.1, "overlap 90 %: twelve of all kinds",
        "finite, at most 1.1 of the elastic energy", "%.4f", ratio);
    end_scene(&s);
}

/* The row of a kind: the worst of all templates and some directions. */
static void overlap_row(int kind, double allowed) {
    char name[64], criterion[64];
    double least = HUGE_VAL, most = 0;
    for (int variant = 0; variant < VARIANTS; variant++)
        for (int k = 0; k < 6; k++) {
            const double ratio = released(kind, variant, 0.1 + k);
            least = fmin(least, ratio), most = fmax(most, ratio);
        }
    snprintf(name, sizeof name, "overlap 90 %%: %s", kind_names[kind]);
    snprintf(criterion, sizeof criterion, "at most %g of the elastic energy", allowed);
    row(most < allowed, name, criterion, "%.4f to %.4f", least, most);
}

static void case_overlap(void) {
    for (int kind = 0; kind < KINDS; kind++) overlap_row(kind, 1.01);
    heap();
}

/* --- long runs ------------------------------------------------------------------------------- */

static void case_gas(void) {
    for (int kind = 0; kind < KINDS; kind++) {
        char name[64];
        stress_scene s = make_gas(kind, 1e-3, 1.0 / 200, 0, 1);
        const int64_t steps = quick ? 200000 : 1000000;
        const double worst = drift(&s, steps, 1000);
        const double most = kind == SHARP ? 1e-2 : 1e-4;
        snprintf(name, sizeof name, "gas of %s", kind_names[kind]);
        row(worst < most && all_finite(&s), name,
            kind == SHARP ? "energy to 1e-2" : "energy to 1e-4", "%.1e in %.0e steps", worst,
            (double)steps);
        end_scene(&s);
    }
}

/* A dozen grains with friction, at rest: places after many steps. What rolls freely has no force on
   it that local damping could act on, so there is some of the global kind. (Without, one grain went
   on at 5e-14 m/s, which is inertia, and 2e-9 radii in 1e7 steps.) */
static void case_rest(void) {
    dem2d_world_desc d = pile_desc();
    d.global_damping = 10;
    stress_scene s = make_pile(&d, &stone, 12, 4, 0, 0);
    dem2d_particle_info at[12];
    const int64_t steps = quick ? 300000 : 10000000;
    double most = 0, turned = 0;
    step(&s.base, 300000);
    for (int i = 0; i < s.grain_count; i++) at[i] = grain_of(&s.base, s.grains[i]);
    const double before = kinetic_of(&s.base);
    for (int64_t i = 0; i < steps; i += 100000) step(&s.base, 100000);
    for (int i = 0; i < s.grain_count; i++) {
        const dem2d_particle_info now = grain_of(&s.base, s.grains[i]);
        most = fmax(most, hypot(now.pose.position.x - at[i].pose.position.x,
                                now.pose.position.y - at[i].pose.position.y) /
                              now.radius);
        turned = fmax(turned, hypot(now.pose.rotation.c - at[i].pose.rotation.c,
                                    now.pose.rotation.s - at[i].pose.rotation.s));
    }
    row(most < 1e-9 && turned < 1e-9, "rest: 12 grains of all kinds",
        "moved by less than 1e-9 radii, turned by 1e-9", "%.1e, %.1e in %.0e steps; %.0e J/m", most,
        turned, (double)steps, before);
    end_scene(&s);
}

/* --- tall piles ------------------------------------------------------------------------------ */

/* Fifty boxes on each other. They stand upright as long as their weight is below 7.8 E I/H^2 with
   E I = k w^2 h/2 for the two points of each face: here 12 times that of the stack. */
static void tower(void) {
    const dem2d_vec corners[4] = {{0, 0}, {0.1, 0}, {0.1, 0.1}, {0, 0.1}};
    dem2d_material_desc rock = stone;
    dem2d_world_desc d = pile_desc();
    dem2d_shape *box;
    double sag = 0, tilt = 0, height = 0;
    dem2d_particle_info at[50];
    rock.normal_stiffness = rock.tangential_stiffness = 1e9;
    d.time_step = 2e-5;
    stress_scene s = make_scene(&d, &rock);
    dem2d_particle_desc g = kind_desc(&s, SHARP, 0, 0.05, 0, 0);
    expect_ok(dem2d_shape_create_polygon(NULL, corners, 4, 0, &box), "box");
    expect_ok(dem2d_world_add_shape(s.base.world, box, &g.shape), "box");
    dem2d_shape_destroy(box);
    g.scale = 1;
    const double weight = 2700 * 0.01 * 9.81;
    for (int i = 0; i < 50; i++) { /* where their weight presses them */
        sag += weight * (50 - i) / (2 * rock.normal_stiffness);
        g.position = vec(0, 0.05 + 0.1 * i - sag);
        add_desc(&s, &g);
    }
    put_plane(&s, 0, 0, 0, 1);
    step(&s.base, 100000);
    for (int i = 0; i < 50; i++) at[i] = grain_of(&s.base, s.grains[i]);
    step(&s.base, quick ? 50000 : 500000);
    const double seconds = (quick ? 50000 : 500000) * d.time_step;
    double moved = 0;
    for (int i = 0; i < 50; i++) {
        const dem2d_particle_info now = grain_of(&s.base, s.grains[i]);
        tilt = fmax(tilt, fabs(now.pose.rotation.s));
        moved = fmax(moved, hypot(now.pose.position.x - at[i].pose.position.x,
                                  now.pose.position.y - at[i].pose.position.y));
        height = now.pose.position.y;
    }
    moved /= 0.1 * seconds;
    row(tilt < 1e-4 && moved < 1e-6 && height > 4.9, "pile: tower of 50 boxes",
        "tilt below 1e-4, drift below 1e-6 sizes/s", "%.1e, %.1e", tilt, moved);
    end_scene(&s);
}

static void layers(void) {
    const dem2d_world_desc d = pile_desc();
    const int wide = quick ? 5 : 10;
    stress_scene s = make_pile(&d, &stone, 50 * wide, wide, 0, 0);
    step(&s.base, quick ? 70000 : 150000);
    const double share = floor_share(&s, 9.81, 500);
    const dem2d_energy e = energy_of(&s.base);
    const double ratio = (e.translational + e.rotational) / (e.normal + e.tangential);
    const dem2d_stats n = stats_of(&s.base);
    row(fabs(share - 1) < 1e-2 && ratio < 1e-4 && n.not_converged == 0,
        "pile: 50 layers of all kinds", "weight to 1e-2, kinetic below 1e-4, all converged",
        "%.5f, %.0e, %lld", share, ratio, (long long)n.not_converged);
    end_scene(&s);
}

static void case_pile(void) {
    tower();
    layers();
}

/* --- needles --------------------------------------------------------------------------------- */

/* Templates of area pi and 50 times as long as wide. */
static dem2d_shape *needle(bool ellipse) {
    const double a = sqrt(50.0), b = 1 / a, f = sqrt(PI) / 2;
    const dem2d_vec p[4] = {{-a * f, -b * f}, {a * f, -b * f}, {a * f, b * f}, {-a * f, b * f}};
    dem2d_shape *shape;
    if (ellipse)
        expect_ok(dem2d_shape_create_ellipse(NULL, a, b, &shape), "needle");
    else
        expect_ok(dem2d_shape_create_polygon(NULL, p, 4, 0, &shape), "needle");
    return shape;
}

/* One that nothing touches: its spin stays, and each step's turn x is right to x^5/120. */
static void lonely_needle(void) {
    dem2d_world_desc d = {0};
    const double turn = 0.005, steps = 1e6;
    d.time_step = 1e-4;
    stress_scene s = make_scene(&d, &glass);
    dem2d_shape *shape = needle(true);
    dem2d_particle_desc g = kind_desc(&s, ELLIPSE, 0, 1, 0, 0);
    expect_ok(dem2d_world_add_shape(s.base.world, shape, &g.shape), "needle");
    dem2d_shape_destroy(shape);
    g.angular_velocity = turn / d.time_step, g.scale = 1;
    const dem2d_particle_id id = add_desc(&s, &g);
    step(&s.base, (int)steps);
    const dem2d_particle_info info = grain_of(&s.base, id);
    const double angle = dem2d_rot_angle(info.pose.rotation);
    const double off = fabs(remainder(angle - turn * steps, 2 * PI));
    const double bound = steps * (pow(turn, 5) / 120 + DBL_EPSILON);
    const double norm = fabs(hypot(info.pose.rotation.c, info.pose.rotation.s) - 1);
    row(off < bound && norm < 1e-15 && info.angular_velocity == g.angular_velocity,
        "needle: alone, 1e6 steps", "angle to 1e6 (x^5/120 + eps) = 2.6e-8, unit, same spin",
        "%.1e, %.0e, %s", off, norm,
        info.angular_velocity == g.angular_velocity ? "same" : "changed");
    end_scene(&s);
}

/* 32 of them in a box. A rod gives at its tip with a quarter of its mass. */
static void needles(bool ellipse) {
    enum { GRAINS = 32 };
    dem2d_world_desc d = {0};
    const double mass = glass.density * PI, k = glass.normal_stiffness;
    const double w = sqrt(k / (mass / 8)), tip = 7.1, speed = 1e-3 * w * 0.14;
    dem2d_shape *shape = needle(ellipse);
    d.time_step = PI / w / 200;
    stress_scene s = make_scene(&d, &glass);
    dem2d_particle_desc g = kind_desc(&s, ELLIPSE, 0, 1, 0, 0);
    expect_ok(dem2d_world_add_shape(s.base.world, shape, &g.shape), "needle");
    dem2d_shape_destroy(shape);
    g.scale = 1;
    for (int i = 0; i < GRAINS; i++) {
        g.position = vec(9 + 15.5 * (i % 4), 3 + 4 * (i / 4)); /* side by side */
        g.angle = uniform(-0.1, 0.1), g.angular_velocity = uniform(-1, 1) * 8 * speed / tip;
        g.velocity = vec(uniform(-1, 1) * 8 * speed, uniform(-1, 1) * 8 * speed);
        add_desc(&s, &g);
    }
    put_box(&s, 0, 0, 66, 36);
    const int64_t steps = quick ? 500000 : 4000000;
    const double worst = drift(&s, steps, 1000), most = ellipse ? 1e-4 : 1e-2;
    const dem2d_stats n = stats_of(&s.base);
    row(worst < most && n.not_converged == 0 && inside_box(&s, 66),
        ellipse ? "needle: gas of ellipses, 50:1" : "needle: gas of polygons, 50:1",
        ellipse ? "energy to 1e-4, all converged, none lost"
                : "energy to 1e-2, all converged, none lost",
        "%.1e, %lld; %.1e collisions", worst, (long long)n.not_converged, (double)n.collisions);
    end_scene(&s);
}

static void case_needle(void) {
    lonely_needle();
    needles(true);
    needles(false);
}

/* --- far away -------------------------------------------------------------------------------- */

/* Two grains that meet, moved by an offset of whole ulps. Until they touch, steps are whole ulps
   too, and there is no difference. From then on each step rounds a place by half an ulp at most,
   and a contact hands that on once: three half ulps for each step. */
static void far_pair(int kind) {
    enum { STEPS = 4000 };
    static dem2d_vec place[2][STEPS][2];
    const double offset = 0x1p26, ulp = 0x1p-26; /* to 2^27 - 1 */
    double touching = 0, apart = 0;
    bool met = false;
    char name[64];
    static bool open[STEPS];
    for (int k = 0; k < 2; k++) {
        dem2d_world_desc d = {0};
        d.time_step = 0x1p-14;
        stress_scene s = make_scene(&d, &glass);
        dem2d_particle_desc g = kind_desc(&s, kind, 1, 1, k * offset, k * offset);
        g.angle = 0.3;
        add_desc(&s, &g);
        g.position.x += 2.5, g.position.y += 0.25, g.velocity.x = -0x1p2;
        g.angle = -0.4;
        add_desc(&s, &g);
        for (int i = 0; i < STEPS; i++) {
            int count;
            step(&s.base, 1);
            expect_ok(dem2d_world_contacts(s.base.world, NULL, 0, &count), "contacts");
            met = met || count > 0;
            open[i] = k == 0 ? met : open[i] || met;
            for (int j = 0; j < 2; j++) {
                const dem2d_vec x = grain_of(&s.base, s.grains[j]).pose.position;
                place[k][i][j] = vec(x.x - k * offset, x.y - k * offset);
            }
        }
        if (k == 0) met = false;
        end_scene(&s);
    }
    for (int i = 0; i < STEPS; i++)
        for (int j = 0; j < 2; j++) {
            const double off =
                hypot(place[1][i][j].x - place[0][i][j].x, place[1][i][j].y - place[0][i][j].y);
            if (open[i])
                touching = fmax(touching, off / (1.5 * ulp * (i + 1)));
            else
                apart = fmax(apart, off);
        }
    snprintf(name, sizeof name, "far: two %s at 2^26", kind_names[kind]);
    row(apart == 0 && touching < 1 && met, name, "same before, then within 1.5 ulp a step",
        "%.1g, %.2g of it", apart, touching);
}

static void case_far(void) {
    for (int kind = 0; kind < KINDS; kind++) far_pair(kind);
    const dem2d_world_desc d = pile_desc();
    stress_scene s = make_pile(&d, &stone, 60, 6, 1e8, -1e8);
    step(&s.base, quick ? 20000 : 100000);
    const double share = floor_share(&s, 9.81, 500);
    row(fabs(share - 1) < 1e-2 && all_finite(&s), "far: pile at (1e8, -1e8)",
        "floor carries the weight to 1e-2", "%.5f", share);
    end_scene(&s);
}

/* --- units ----------------------------------------------------------------------------------- */

/* The numbers of a pile under a servo lid in units of 2^length m, 2^time s, 2^mass kg/m. */
static int unit_run(const int power[3], double *numbers) {
    const double length = ldexp(1, power[0]), time = ldexp(1, power[1]);
    const double mass = ldexp(1, power[2]), r = 0.025 * length, cell = 2.7 * r;
    dem2d_material_desc material = stone;
    dem2d_world_desc d = pile_desc();
    int count = 0;
    material.density *= mass / (length * length);
    material.normal_stiffness *= mass / (time * time);
    material.tangential_stiffness *= mass / (time * time);
    d.time_step *= time, d.gravity.y *= length / (time * time), d.local_damping = 0.2;
    d.global_damping = 0.5 / time;
    stress_scene s = make_scene(&d, &material);
    for (int i = 0; i < 36; i++) {
        dem2d_particle_desc g = kind_desc(&s, i % KINDS, i / KINDS % VARIANTS, r,
                                          cell * (i % 6 + 0.5), cell * (i / 6 + 0.5));
        g.angle = i,
        g.velocity = vec(length / time * uniform(-1, 1), length / time * uniform(-1, 1));
        g.angular_velocity = uniform(-1, 1) / time;
        add_desc(&s, &g);
    }
    put_plane(&s, 0, 0, 0, 1), put_plane(&s, 0, 0, 1, 0), put_plane(&s, 6 * cell, 0, -1, 0);
    dem2d_wall_desc lid = wall_desc(&s, 0, 6.2 * cell, 0, -1);
    lid.mode = DEM2D_WALL_SERVO, lid.stress = 2e3 * mass / (time * time);
    lid.max_speed = length / time, lid.spans[0] = s.walls[1], lid.spans[1] = s.walls[2];
    put_wall(&s, &lid);
    step(&s.base, 3000);
    for (int i = 0; i < s.grain_count; i++, count += GRAIN_NUMBERS)
        grain_numbers(&s, s.grains[i], numbers + count);
    end_scene(&s);
    return count;
}

static void case_units(void) {
    static double first[64 * GRAIN_NUMBERS], other[64 * GRAIN_NUMBERS];
    static const int powers[][3] = {{40, 0, 0},  {-40, 0, 0}, {0, 40, 0},   {0, -40, 0},
                                    {0, 0, 40},  {0, 0, -40}, {40, 40, 40}, {-40, -40, -40},
                                    {1, -17, 5}, {13, 7, -29}};
    const int none[3] = {0, 0, 0}, count = unit_run(none, first);
    int differ = 0;
    for (int k = 0; k < COUNT_OF(powers); k++) {
        const int *p = powers[k];
        if (unit_run(p, other) != count) differ++;
        for (int i = 0; i < count; i++) {
            const signed char *u = grain_units[i % GRAIN_NUMBERS];
            const double scaled = ldexp(first[i], u[0] * p[0] + u[1] * p[1] + u[2] * p[2]);
            differ += memcmp(&scaled, &other[i], sizeof scaled) != 0;
        }
    }
    row(differ == 0, "units: lengths, times, masses by 2^k", "|k| up to 40: the same bits, 10 runs",
        "%d of %d numbers differ", differ, count * COUNT_OF(powers));
}

/* --- changes in the middle of a run ---------------------------------------------------------- */

static void case_gravity(void) {
    const dem2d_world_desc d = pile_desc();
    stress_scene s = make_pile(&d, &stone, 90, 9, 0, 0);
    const int steps = quick ? 25000 : 50000;
    double share[2], fallen = 0;
    step(&s.base, 2 * steps);
    share[0] = floor_share(&s, 9.81, 500);
    for (int k = 0; k < 6; k++) { /* off, up, sideways, ... */
        const dem2d_vec ways[3] = {{0, 0}, {0, 20}, {9.81, 0}};
        expect_ok(dem2d_world_set_gravity(s.base.world, ways[k % 3]), "gravity");
        step(&s.base, steps / 5);
        fallen = fmax(fallen, kinetic_of(&s.base));
    }
    expect_ok(dem2d_world_set_gravity(s.base.world, d.gravity), "gravity");
    step(&s.base, 2 * steps);
    share[1] = floor_share(&s, 9.81, 500);
    const dem2d_energy e = energy_of(&s.base);
    const double ratio = (e.translational + e.rotational) / (e.normal + e.tangential);
    row(fabs(share[0] - 1) < 1e-2 && fabs(share[1] - 1) < 1e-2 && ratio < 1e-3 && isfinite(fallen),
        "gravity: off, up, sideways, on again", "weight to 1e-2 before and after, then at rest",
        "%.5f, %.5f, %.0e", share[0], share[1], ratio);
    end_scene(&s);
}

/* Grains are taken out of a pile and dropped in above. Returns the state, and what is in use early
   and late; `skin` must not show in that of discs. */
static uint64_t come_and_go(int kinds, double skin, int rounds, double bytes[2], bool *sound) {
    enum { GRAINS = 200, WIDE = 20 };
    dem2d_world_desc d = pile_desc();
    const double r = 0.025, cell = 2.7 * r;
    d.skin = skin;
    stress_scene s = make_scene(&d, &stone);
    *sound = true;
    for (int i = 0; i < GRAINS; i++) {
        dem2d_particle_desc g =
            kind_desc(&s, i % kinds, i / kinds % VARIANTS, r * uniform(0.7, 1),
                      cell * (i % WIDE + 0.5 + uniform(-0.1, 0.1)), cell * (i / WIDE + 0.5));
        g.angle = uniform(-3, 3);
        add_desc(&s, &g);
    }
    put_plane(&s, 0, 0, 0, 1), put_plane(&s, 0, 0, 1, 0), put_plane(&s, WIDE * cell, 0, -1, 0);
    for (int k = 0; k < rounds; k++) {
        step(&s.base, 200);
        for (int i = 0; i < 2; i++) {
            const int which = (int)uniform(0, GRAINS);
            dem2d_particle_desc g =
                kind_desc(&s, k % kinds, i % VARIANTS, r * uniform(0.7, 1),
                          cell * (10 * i + k % 10 + 0.5), cell * 12); /* where none is any more */
            g.angle = k, g.velocity.y = -3;
            expect_ok(dem2d_world_remove_particle(s.base.world, s.grains[which]), "remove");
            expect_ok(dem2d_world_add_particle(s.base.world, &g, &s.grains[which]), "add");
        }
        if (k == rounds / 4) bytes[0] = (double)stats_of(&s.base).bytes;
    }
    dem2d_particle_id ids[GRAINS];
    int count;
    bytes[1] = (double)stats_of(&s.base).bytes;
    expect_ok(dem2d_world_particles(s.base.world, ids, GRAINS, &count), "ids");
    *sound = count == GRAINS && all_finite(&s) && stats_of(&s.base).contacts > GRAINS / 4;
    for (int i = 0; i < count; i++) {
        const dem2d_vec x = grain_of(&s.base, ids[i]).pose.position;
        *sound = *sound && x.x > 0 && x.x < WIDE * cell && x.y > 0 && (int)ids[i].index == i;
    }
    const uint64_t state = state_of(&s);
    end_scene(&s);
    return state;
}

static void case_exchange(void) {
    double bytes[2];
    bool sound, again;
    const int rounds = quick ? 200 : 800;
    (void)come_and_go(KINDS, 0, rounds, bytes, &sound);
    row(sound && bytes[1] < 1.3 * bytes[0], "exchange: all kinds",
        "all there and in place, memory within 1.3 times", "%s, %.2f",
        sound ? "there" : "NOT there", bytes[1] / bytes[0]);
    const uint64_t one = come_and_go(1, 0, rounds, bytes, &sound);
    const uint64_t two = come_and_go(1, 1, rounds, bytes, &again);
    row(sound && again && one == two, "exchange: discs, two skins", "the same bits", "%s",
        one == two ? "same" : "different");
}

/* --- jamming --------------------------------------------------------------------------------- */

typedef struct squeeze_case {
    const char *name;
    int kind; /* -1: all */
    double damping;
    int side; /* grains in a row */
} squeeze_case;

/* Four walls close in on grains without friction, until the mean number of neighbours says that
   they have jammed, and until the area is a tenth less. What the walls put in is what is there, or
   with damping at most that. */
static void squeeze(const squeeze_case *c) {
    dem2d_world_desc d = {0};
    const double r = 0.02, cell = 2.6 * r, mass = glass.density * PI * r * r, side = c->side * cell;
    const double speed = 2e-4 * r * sqrt(glass.normal_stiffness / mass); /* slow against waves */
    d.time_step = contact_time(mass, glass.normal_stiffness, true) / 100;
    d.local_damping = c->damping;
    stress_scene s = make_scene(&d, &glass);
    for (int i = 0; i < c->side * c->side; i++) {
        const int kind = c->kind >= 0 ? c->kind : i % KINDS;
        const int variant = c->kind >= 0 ? i % VARIANTS : i / KINDS % VARIANTS;
        dem2d_particle_desc g = kind_desc(&s, kind, variant, i % 2 ? r : r / 1.4,
                                          cell * (i % c->side + 0.5), cell * (i / c->side + 0.5));
        g.angle = uniform(-3, 3);
        g.velocity = vec(uniform(-1, 1) * speed, uniform(-1, 1) * speed);
        add_desc(&s, &g);
    }
    const double at[4][4] = {{0, 0, 0, 1}, {0, 0, 1, 0}, {side, 0, -1, 0}, {0, side, 0, -1}};
    for (int i = 0; i < 4; i++) {
        dem2d_wall_desc w = wall_desc(&s, at[i][0], at[i][1], at[i][2], at[i][3]);
        w.mode = DEM2D_WALL_MOVING, w.velocity = vec(speed * w.normal.x, speed * w.normal.y);
        put_wall(&s, &w);
    }
    step(&s.base, 1);
    const double first = kinetic_of(&s.base);
    double work = 0, jammed = 0, area = 0;
    dem2d_packing p;
    dem2d_result result = DEM2D_OK;
    for (int i = 0; i < 2000000 && result == DEM2D_OK; i++) {
        result = dem2d_world_step(s.base.world, 1, NULL);
        for (int k = 0; k < 4; k++) { /* the force of this pass along the way of this move */
            const dem2d_wall_info w = wall_at(&s, k);
            work -= (w.force.x * w.velocity.x + w.force.y * w.velocity.y) * d.time_step;
        }
        if (i % 50) continue;
        area = (wall_at(&s, 2).point.x - wall_at(&s, 1).point.x) *
               (wall_at(&s, 3).point.y - wall_at(&s, 0).point.y);
        expect_ok(dem2d_world_packing(s.base.world, &p), "packing");
        if (jammed == 0 && p.coordination > 3.9) jammed = area;
        if (jammed > 0 && area < 0.9 * jammed) break;
    }
    const dem2d_energy e = energy_of(&s.base);
    const double closure = (e.translational + e.rotational + e.normal - first) / work;
    const bool sane = closure < 1.01 && (c->damping > 0 ? closure > 0 : closure > 0.99);
    expect_ok(dem2d_world_packing(s.base.world, &p), "packing");
    row(result == DEM2D_OK && all_finite(&s) && jammed > 0 && sane, c->name,
        c->damping > 0 ? "jams, 10 % more; energy at most 1.01 of the work"
                       : "jams, 10 % more; energy = work to 1e-2",
        "%.4f; jammed at %.3f, overlaps to %.0f %%", closure, p.solid_area / jammed,
        100 * p.max_overlap);
    end_scene(&s);
}

static void case_squeeze(void) {
    static const squeeze_case list[] = {
        {"squeeze: discs", DISC, 0, 12},
        {"squeeze: ellipses", ELLIPSE, 0, 12},
        {"squeeze: polybeziers", BEZIER, 0, 8},
        {"squeeze: Fourier series", SERIES, 0, 8},
        {"squeeze: rounded polygons", ROUNDED, 0, 8},
        {"squeeze: polygons", SHARP, 0, 8},
        {"squeeze: all kinds", -1, 0, 12},
        {"squeeze: all kinds, damped", -1, 0.3, 12},
    };
    for (int i = 0; i < COUNT_OF(list); i++)
        if (!quick || i != 1) squeeze(&list[i]);
}

/* --- servo walls ----------------------------------------------------------------------------- */

/* Grains under servo walls. Times are in contact times of one of them at a wall; speeds in units of
   the force on one at rest over sqrt(kn m). */
typedef struct press {
    int kind;  /* -1: all */
    int side;  /* grains in a row and in a column */
    bool open; /* left and right are servo walls as well as the lid */
    double damping_ratio, steps, top_speed;
    double weight, local; /* of a grain over the force on it; damping */
    bool segment;
    dem2d_law_fn *law;
} press;

typedef struct press_scene {
    stress_scene s;
    double target, unit; /* Pa; m/s */
    int first;           /* servo walls: from here to 3 */
} press_scene;

/* Twice as stiff as the materials, with a dashpot that they do not have, without friction. */
static void other_law(void *user, dem2d_law_batch *b) {
    (void)user;
    for (int k = 0; k < b->count; k++) {
        b->stiffness[k] *= 2, b->friction[k] = 0;
        b->dashpot[k] = 2 * 0.4 * sqrt(b->mass[k] * b->stiffness[k]);
    }
    dem2d_law_builtin(b);
}

/* From now on the servo walls hold the target, or so many times as much, at such a top speed. */
static void press_set(press_scene *p, const press *c, double top_speed, double times) {
    for (int i = p->first; i < 4; i++) {
        const dem2d_wall_info now = wall_at(&p->s, i);
        dem2d_wall_desc w = wall_desc(&p->s, now.point.x, now.point.y, now.normal.x, now.normal.y);
        w.mode = DEM2D_WALL_SERVO, w.stress = times * p->target, w.max_speed = top_speed * p->unit;
        w.spans[0] = p->s.walls[i == 3 ? 1 : 0], w.spans[1] = p->s.walls[i == 3 ? 2 : 3];
        if (c->segment) { /* twice as long as the box is wide */
            const double width = wall_at(&p->s, 2).point.x;
            memset(w.spans, 0, sizeof w.spans);
            w.segment = true, w.end = w.point, w.stress /= 2;
            w.point.x = 1.5 * width, w.end.x = -0.5 * width;
        }
        expect_ok(dem2d_world_set_wall(p->s.base.world, p->s.walls[i], &w), "servo wall");
    }
    p->target *= times;
}

static press_scene press_make(const press *c) {
    const double r = 0.02, kn = 1e7, overlap = 1e-3 * r, mass = 2000 * PI * r * r;
    const double cell = c->side > 1 ? 2.3 * r : 4 * r, width = c->side * cell;
    const dem2d_material_desc rock = {.density = 2000,
                                      .normal_stiffness = kn,
                                      .tangential_stiffness = 0.8 * kn,
                                      .friction = 0.3,
                                      .damping_ratio = c->law ? 0 : c->damping_ratio};
    dem2d_world_desc d = {0};
    d.time_step = contact_time(mass, kn, false) / c->steps, d.local_damping = c->local;
    d.gravity.y = -c->weight * kn * overlap / mass, d.law = c->law;
    press_scene p = {make_scene(&d, &rock), kn * overlap / (c->side > 1 ? 2 * r : width), 0, 0};
    p.unit = overlap * sqrt(kn / mass), p.first = c->open ? 1 : 3;
    for (int i = 0; i < c->side * c->side; i++) {
        const int kind = c->kind >= 0 ? c->kind : i % KINDS;
        dem2d_particle_desc g =
            kind_desc(&p.s, kind, c->side > 1 ? i % VARIANTS : 0, r * (i % 2 ? 0.75 : 1),
                      cell * (i % c->side + 0.5), cell * (i / c->side + 0.5));
        g.angle = c->side > 1 ? uniform(-3, 3) : 0;
        add_desc(&p.s, &g);
    }
    put_box(&p.s, 0, 0, width, width);
    return p;
}

/* Are all servo walls at such a top speed at rest over ten contact times: mean stress right to
   1e-4, that of each step to 1e-2, speed below 1e-3 of the top speed? */
static bool press_rests(press_scene *p, const press *c, double top_speed) {
    const int steps = (int)(10 * c->steps);
    double mean[4] = {0, 0, 0, 0};
    bool rests = true;
    for (int i = 0; i < steps; i++) {
        step(&p->s.base, 1);
        for (int k = p->first; k < 4; k++) {
            const dem2d_wall_info w = wall_at(&p->s, k);
            const double speed = hypot(w.velocity.x, w.velocity.y);
            mean[k] += w.stress / w.target / steps;
            rests =
                rests && fabs(w.stress / w.target - 1) < 1e-2 && speed < 1e-3 * top_speed * p->unit;
        }
    }
    for (int k = p->first; k < 4; k++) rests = rests && fabs(mean[k] - 1) < 1e-4;
    return rests;
}

/* Contact times until the walls are at rest, and still are after as long again; more than `most` if
   they do not come to it. */
static double press_time(press_scene *p, const press *c, double top_speed, double most) {
    double time = 0;
    for (int rested = 0; rested < 2 && time <= most; time += 10)
        rested = press_rests(p, c, top_speed) ? rested + 1 : 0;
    return time;
}

/* The same after the target has risen by a tenth, the grains having been pressed before by fast
   walls; -1: the time step is above what is safe. */
static double press_run(const press *c, double most) {
    press_scene p = press_make(c);
    const double fast = c->side > 1 ? 30 : 100;
    double safe, limit, time = -1;
    press_set(&p, c, fast, 1);
    (void)press_time(&p, c, fast, most);
    expect_ok(dem2d_world_time_step_bounds(p.s.base.world, &safe, &limit, NULL), "bounds");
    if (contact_time(2000 * PI * 4e-4, 1e7, false) / c->steps <= safe) {
        press_set(&p, c, c->top_speed, 1.1);
        time = press_time(&p, c, c->top_speed, most);
    }
    end_scene(&p.s);
    return time;
}

/* A row of the table: the same for all damping ratios, time steps and top speeds. */
static void press_row(const char *name, press c, const double *steps, int step_count, double most) {
    static const double ratios[] = {0, 0.02, 0.2, 0.5, 1}, speeds[] = {0.01, 0.1, 1, 10, 100};
    int runs = 0, failed = 0, unsafe = 0;
    double longest = 0;
    for (int i = 0; i < COUNT_OF(ratios); i++)
        for (int j = 0; j < step_count; j++)
            for (int k = 0; k < COUNT_OF(speeds); k++) {
                if (quick && (i + j + k) % 3) continue;
                c.damping_ratio = ratios[i], c.steps = steps[j], c.top_speed = speeds[k];
                const double time = press_run(&c, most);
                runs += time >= 0, unsafe += time<0, failed += time> most;
                longest = fmax(longest, time);
                if (time > most)
                    fprintf(stderr, "%s: damping ratio %g, t_c/%g, top speed %g\n", name,
                            c.damping_ratio, c.steps, c.top_speed);
            }
    row(failed == 0 && runs > 0, name, "rests: mean 1e-4, steps 1e-2, speed 1e-3 of top",
        "%d of %d fail, %d unsafe; %.0f t_c", failed, runs, unsafe, longest);
}

/* A grain that is no disc rocks between floor and lid at an angle of least width, where to first
   order the lid does not move: local damping alone takes that energy. */
static void case_servo(void) {
    static const double steps[] = {10, 30, 100, 300, 1000}, few[] = {15, 50};
    for (int kind = 0; kind < KINDS; kind++) {
        const press one = {kind, 1, false, 0, 0, 0, 0, kind == DISC ? 0 : 0.7, false, NULL};
        char name[64];
        snprintf(name, sizeof name, "servo: one of the %s", kind_names[kind]);
        press_row(name, one, steps, quick ? 3 : 5, 1000);
    }
    press_row("servo: one, segment", (press){DISC, 1, false, 0, 0, 0, 0, 0, true, NULL}, few, 2,
              1000);
    press_row("servo: one, three times its target",
              (press){DISC, 1, false, 0, 0, 0, 3, 0, false, NULL}, few, 2, 1000);
    press_row("servo: one, local damping", (press){DISC, 1, false, 0, 0, 0, 0, 0.7, false, NULL},
              few, 2, 1000);
    press_row("servo: one, a law it is not told of",
              (press){DISC, 1, false, 0, 0, 0, 0, 0, false, other_law}, few, 2, 1000);
    press_row("servo: 289 discs", (press){DISC, 17, false, 0, 0, 0, 0, 0.3, false, NULL}, few, 2,
              3000);
    press_row("servo: 289 of all kinds", (press){-1, 17, false, 0, 0, 0, 0, 0.3, false, NULL}, few,
              2, 3000);
    press_row("servo: 289 of all kinds, three walls",
              (press){-1, 17, true, 0, 0, 0, 0, 0.3, false, NULL}, few, 2, 3000);
    if (!quick)
        press_row("servo: 289 discs, t_c/1000",
                  (press){DISC, 17, true, 0, 0, 0, 0, 0.7, false, NULL}, &steps[4], 1, 500);
}

/* --- the table ------------------------------------------------------------------------------- */

typedef struct stress_case {
    const char *name;
    void (*run)(void);
} stress_case;

static const stress_case cases[] = {
    {"step", case_step},
    {"stiffness", case_stiffness},
    {"mass", case_mass},
    {"size", case_size},
    {"speed", case_speed},
    {"overlap", case_overlap},
    {"gas", case_gas},
    {"rest", case_rest},
    {"pile", case_pile},
    {"needle", case_needle},
    {"far", case_far},
    {"units", case_units},
    {"gravity", case_gravity},
    {"exchange", case_exchange},
    {"squeeze", case_squeeze},
    {"servo", case_servo},
    {"reversal", case_reversal},
    {"objectivity", case_objectivity},
    {"ratcheting", case_ratcheting},
    {"spectrum", case_spectrum},
    {"joints", case_joints},
};

int main(int argc, char **argv) {
    const char *only = "";
    int run = 0;
    if (argc > 1 && strcmp(argv[1], "--quick") == 0) quick = true, argc--, argv++;
    if (argc > 1) only = argv[1];
    printf("%-36s %-52s %-44s %s\n", "case", "criterion", "got", "pass");
    for (int i = 0; i < COUNT_OF(cases); i++) {
        if (strncmp(cases[i].name, only, strlen(only)) != 0) continue;
        const clock_t start = clock();
        cases[i].run();
        fprintf(stderr, "%s: %.1f s\n", cases[i].name, (double)(clock() - start) / CLOCKS_PER_SEC);
        run++;
    }
    if (argc > 2 || run == 0) {
        fprintf(stderr, "usage: stress [--quick] [CASE]\n");
        return 2;
    }
    printf("stress: %d of %d rows passed\n", rows - failures, rows);
    return failures > 0;
}
