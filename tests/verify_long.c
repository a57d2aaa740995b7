/* verify_long - the rows of verify.c that take minutes: flow out of a silo, pressure in a silo,
   jamming, collapse of columns, more of the gases of polygons. About half an hour.

   Discs of 8 to 12 mm (mean d), friction 0.5 (1 in silos that flow), restitution 0.5. Bands are
   from the literature, and were fixed before the first run:
   - flow out of a slot: (D - k d)^1.5 in two dimensions, not dependent on the head (Beverloo,
     Leniger and van de Velde 1961, Chem. Eng. Sci. 15; Mankoc et al. 2007, Granular Matter 9): with
     that exponent within 3 %, k 0.5 to 3, flow by head within 0.05; the ratio of the flows from
     slots of 14 d and 8 d is 3.01 in LAMMPS (gran/hooke/history, the same silos), 3 %;
   - pressure in a silo: saturates as 1 - exp(-z/lambda) (Janssen 1895, Vanel and Clement 1999);
   - frictionless discs of sizes 1 and 1.4 in equal numbers jam at 0.842, from which samples of N
     discs are off by about N^-0.55/6 (O'Hern 2003): some hundred in the middle of a box, 0.005;
   - columns of aspect a in two dimensions: run-out over width as a for a below 2 to 3, as a^(2/3)
     to a^0.7 above (Lube et al. 2005, Phys. Rev. E 72; Lajeunesse, Monnier and Homsy 2005, Phys.
     Fluids 17; Staron and Hinch 2005, J. Fluid Mech. 545); exponents 1 +- 0.2 and 0.6 to 0.8. */
#define _POSIX_C_SOURCE 200809L
#define DEM2D_IMPLEMENTATION
#include "dem2d.h"
#include "verify.h"

#define SMALL 0.008
#define LARGE 0.012
#define MEAN 0.01

/* --- discs in a bin -------------------------------------------------------------------------- */

/* Time step: a 25th of the contact of two of the smallest. */
static double bin_step(double stiffness) {
    return (double)PI * sqrt(disc_mass(SMALL / 2) / 2 / stiffness) / 25;
}

static scene open_bin(double stiffness, double friction) {
    dem2d_world_desc desc = world_desc(bin_step(stiffness));
    dem2d_material_desc material = stone_desc(stiffness, friction);
    desc.gravity.y = -G, desc.contact_tolerance = 0;
    material.normal_stiffness = stiffness;
    must(dem2d_damping_ratio(0.5, &material.damping_ratio), "restitution");
    return open_scene(&desc, &material);
}

/* Of a disc and its part of the voids, when poured. */
static double disc_area(void) {
    return (double)PI / 4 * MEAN * MEAN * 1.01 / 0.81;
}

/* Rows of discs above a height, between 0 and a width; returns the height of the next row. */
static double pour(const scene *s, dem2d_shape_id shape, int count, double width, double y) {
    const int columns = (int)(width / (1.1 * LARGE));
    const double pitch = width / columns;
    for (int i = 0; i < count; i++) {
        dem2d_particle_desc desc = {0};
        dem2d_particle_id id;
        desc.shape = shape, desc.material = s->material;
        desc.scale = uniform(SMALL, LARGE) / 2;
        const double free = (pitch - LARGE) / 2;
        desc.position.x = (i % columns + 0.5) * pitch + uniform(-free, free);
        desc.position.y = y + (i / columns + 0.5) * 1.05 * LARGE;
        desc.velocity.x = uniform(-0.05, 0.05);
        must(dem2d_world_add_particle(s->world, &desc, &id), "disc");
    }
    return y + (count / columns + 1) * 1.05 * LARGE;
}

static dem2d_shape_id unit_disc(const scene *s) {
    dem2d_shape_id id;
    dem2d_shape *shape = make_disc(1);
    must(dem2d_world_add_shape(s->world, shape, &id), "disc");
    dem2d_shape_destroy(shape);
    return id;
}

static void run_for(const scene *s, double stiffness, double seconds) {
    step(s, (int)(seconds / bin_step(stiffness)));
}

/* --- flow out of a silo ---------------------------------------------------------------------- */

typedef struct silo {
    scene s;
    double width, top; /* of the silo; where grains come back */
    int column;        /* of the next that does */
} silo;

/* Between refills, s, and the speed of what comes back, m/s: it is then out of the way of the next.
 */
#define REFILL 8e-3
#define RAIN 1.6

/* Grains below the silo go back to the top; returns their mass. */
static double refill(silo *p) {
    int count;
    double mass = 0;
    dem2d_particle_id *ids = all_ids(&p->s, &count);
    for (int i = 0; i < count; i++) {
        const dem2d_particle_info info = grain_of(&p->s, ids[i]);
        if (info.pose.position.y > -3 * MEAN) continue;
        const int columns = (int)(p->width / (1.3 * MEAN));
        const double x = (p->column + 0.5) * p->width / columns;
        p->column = (p->column + 101) % columns; /* a prime, so that none is left out */
        must(dem2d_world_move_particle(p->s.world, ids[i], vec(x, p->top), 0), "refill");
        must(dem2d_world_drive_particle(p->s.world, ids[i], DEM2D_FREE, vec(0, -RAIN), 0),
             "refill");
        mass += info.mass;
    }
    free(ids);
    return mass;
}

/* Flow in kg/(m s) through a slot in the floor of a silo filled to a height, averaged over a time
   that begins when the flow is steady, 5 sqrt(D/g) after the slot was opened. */
static double silo_flow(double slot, double width, double height, double stiffness, double seconds,
                        uint64_t seed) {
    silo p = {open_bin(stiffness, 1), width, 0, 0};
    const double left = (p.width - slot) / 2, right = left + slot;
    random_state = seed;
    add_plane(&p.s, 0, 0, 1, 0), add_plane(&p.s, p.width, 0, -1, 0);
    add_segment(&p.s, vec(0, 0), vec(left, 0));
    add_segment(&p.s, vec(right, 0), vec(p.width, 0));
    const dem2d_wall_id plug = add_segment(&p.s, vec(left, 0), vec(right, 0));
    pour(&p.s, unit_disc(&p.s), (int)(width * height / disc_area()), p.width, 0);
    run_for(&p.s, stiffness, 0.6 + 2 * sqrt(height / G));
    int count;
    dem2d_particle_id *ids = all_ids(&p.s, &count);
    for (int i = 0; i < count; i++) p.top = fmax(p.top, grain_of(&p.s, ids[i]).pose.position.y);
    free(ids);
    p.top += 4 * MEAN + 0.2 * width; /* what the slot does not reach heaps up beside it */
    must(dem2d_world_remove_wall(p.s.world, plug), "plug");
    const int steps = (int)(REFILL / bin_step(stiffness));
    const double start = 5 * sqrt(slot / G);
    double mass = 0, time = 0, from = 0;
    while (time < start + seconds) {
        step(&p.s, steps);
        const double out = refill(&p);
        time += steps * bin_step(stiffness);
        if (time <= start)
            from = time;
        else
            mass += out;
    }
    close_scene(&p.s);
    return mass / (time - from);
}

/* Least squares of log y over log x: the slope; residual gets the root mean square. */
static double log_slope(const double *x, const double *y, int count, double *residual) {
    double sx = 0, sy = 0, sxx = 0, sxy = 0, syy = 0;
    for (int i = 0; i < count; i++) {
        const double u = log(x[i]), v = log(y[i]);
        sx += u / count, sy += v / count;
        sxx += u * u / count, sxy += u * v / count, syy += v * v / count;
    }
    const double slope = (sxy - sx * sy) / (sxx - sx * sx);
    *residual = sqrt(fmax(0, syy - sy * sy - slope * (sxy - sx * sy)));
    return slope;
}

/* A slot of D is in a silo max(2.5 D, D + 30 d) wide (what Mankoc et al. 2007 ask for; in one 2.5 D
   wide the flow from a slot of 8 d is 4 % higher), filled to 3 D, of stiffness as D: depth over D
   and overlaps, on which the flow depends a little, are alike. Slots of 6 d clog; small ones are
   noisy, and run for longer.

   With k free the exponent that fits best is 1.8, which says more of the fit than of the flow (it
   is off by 0.04 for 1 % in each flow), so the exponent is held: over so wide a range the law does
   not hold (Mankoc et al. 2007), flow over D^1.5 nears its end as 1 - exp(-D/(n d)) does, with n 10
   to 15 for spheres (Sharma et al. 2025, arXiv 2509.14415). That, with n 8.6, and the exponent 1.5,
   with k 2.7, are within 2 %.

   The flow does not depend on the head if the filling is some lengths lambda of Janssen's deep (1
   to 3 widths in two dimensions, see below), if grains are hard (Pongo et al. 2021, New J. Phys.
   23, 023001) and friction within the filling is high (Staron, Lagree and Popinet 2012, Phys.
   Fluids 24, 103301). From 1.7 widths to 3.3 it grew by 14 %, by 10 % with discs five times as
   hard, by 6 % with a friction of 1 for 0.5; and by 6 % from 6 widths to 12. */
static void hopper(void) {
    static const double slots[] = {8, 10.5, 14, 18.5, 24};
    enum { SLOTS = COUNT_OF(slots) };
    double flow[SLOTS], best = HUGE_VAL, reach = 0, residual;
    for (int i = 0; i < SLOTS; i++) {
        const double slot = slots[i] * MEAN, width = fmax(2.5 * slot, slot + 30 * MEAN);
        flow[i] = silo_flow(slot, width, 3 * slot, 1.5e5 * slots[i],
                            1 + 350 / (slots[i] * slots[i]), 63 + (uint64_t)i);
        printf("slot of %g d: %.4g kg/(m s)\n", slots[i], flow[i]);
        fflush(stdout);
    }
    for (double k = 0; k < 6; k += 0.01) {
        double sum = 0, square = 0;
        for (int i = 0; i < SLOTS; i++) {
            const double off = log(flow[i]) - 1.5 * log(slots[i] - k);
            sum += off / SLOTS, square += off * off / SLOTS;
        }
        residual = sqrt(fmax(0, square - sum * sum));
        if (residual < best) best = residual, reach = k;
    }
    basis = "LAMMPS";
    row_near("flow out of a silo: slot of 14 d over slot of 8 d", 3.01, flow[2] / flow[0], 0.03);
    basis = "literature";
    row_between("flow out of a silo, (D - k d)^1.5: the k that fits best", 0.5, 3, reach);
    row_below("flow out of a silo: rms of that fit, relative", 0.03, best);
    double head[2];
    for (int i = 0; i < 2; i++)
        head[i] = silo_flow(8 * MEAN, 20 * MEAN, (6 + 6 * i) * 20 * MEAN, 4e6, 4, 49);
    row_near("flow out of a silo: 12 widths deep over 6, ratio of flows", 1, head[1] / head[0],
             0.05);
}

/* --- pressure in a silo ---------------------------------------------------------------------- */

enum { FILLINGS = 12, LAYER = 105, SILOS = 3 };

typedef struct filling {
    double height, force, weight; /* over the floor, in widths; on it and of all, N/m */
} filling;

/* 105 discs more each time, about as high as the silo of 10 d is wide; then the floor goes down by
   two d, so that friction holds up what it can, and its force is averaged over the last three
   quarters of that. Adds to the fillings. */
static void fill_silo(uint64_t seed, filling *fillings) {
    const double stiffness = 5e5, width = 10 * MEAN, speed = 0.03, way = 2 * MEAN;
    const scene s = open_bin(stiffness, 0.5);
    const dem2d_shape_id shape = unit_disc(&s);
    double highest = 0;
    random_state = seed;
    add_plane(&s, 0, 0, 1, 0), add_plane(&s, width, 0, -1, 0);
    const dem2d_wall_id floor = add_floor(&s);
    dem2d_wall_desc desc = {0};
    desc.material = s.material, desc.normal = vec(0, 1);
    for (int k = 0; k < FILLINGS; k++) {
        double force = 0;
        pour(&s, shape, LAYER, width, highest);
        run_for(&s, stiffness, 0.5);
        desc.point = wall_of(&s, floor).point;
        desc.mode = DEM2D_WALL_MOVING, desc.velocity = vec(0, -speed);
        must(dem2d_world_set_wall(s.world, floor, &desc), "floor");
        run_for(&s, stiffness, 0.25 * way / speed);
        const int steps = (int)(0.75 * way / speed / bin_step(stiffness));
        for (int i = 0; i < steps; i++) {
            step(&s, 1);
            force -= wall_of(&s, floor).force.y / steps;
        }
        desc.point = wall_of(&s, floor).point;
        desc.mode = DEM2D_WALL_STILL, desc.velocity = vec(0, 0);
        must(dem2d_world_set_wall(s.world, floor, &desc), "floor");
        int count;
        double weight = 0;
        dem2d_particle_id *ids = all_ids(&s, &count);
        highest = -HUGE_VAL;
        for (int i = 0; i < count; i++) {
            const dem2d_particle_info info = grain_of(&s, ids[i]);
            highest = fmax(highest, info.pose.position.y + info.radius);
            weight += info.mass * G;
        }
        free(ids);
        fillings[k].height += (highest - desc.point.y) / width / SILOS;
        fillings[k].force += force / SILOS, fillings[k].weight += weight / SILOS;
    }
    close_scene(&s);
}

/* F = end (1 - exp(-z/lambda)) by least squares; returns the root mean square over the end. */
static double fit_janssen(const filling *fillings, double *lambda) {
    double least = HUGE_VAL, end = 0;
    for (double l = 0.2; l < 10; l *= 1.005) {
        double fs = 0, ss = 0, sum = 0;
        for (int k = 0; k < FILLINGS; k++) {
            const double rise = 1 - exp(-fillings[k].height / l);
            fs += fillings[k].force * rise, ss += rise * rise;
        }
        for (int k = 0; k < FILLINGS; k++) {
            const double rise = 1 - exp(-fillings[k].height / l);
            sum += pow(fillings[k].force - fs / ss * rise, 2) / FILLINGS;
        }
        if (sum < least) least = sum, *lambda = l, end = fs / ss;
    }
    return sqrt(least) / end;
}

static void janssen(void) {
    filling f[FILLINGS];
    double lambda = 0;
    memset(f, 0, sizeof f);
    for (uint64_t seed = 51; seed < 51 + SILOS; seed++) fill_silo(seed, f);
    for (int k = 0; k < FILLINGS; k++)
        printf("filled to %.3g widths: floor force/weight %.3g, force %.4g N/m\n", f[k].height,
               f[k].force / f[k].weight, f[k].force);
    const double rms = fit_janssen(f, &lambda);
    basis = "literature";
    row_near("silo: floor force filled to 12 widths over that to 9", 1,
             (f[11].force + f[10].force) / (f[8].force + f[7].force), 0.1);
    row_below("silo: floor force/weight filled to 12 widths", 0.3, f[11].force / f[11].weight);
    row_below("silo: rms from 1 - exp(-z/lambda), of the end value", 0.08, rms);
    /* lambda = width/(2 K mu) with K between Rankine's active state at 30 degrees, 1/3, and 1 */
    row_between("silo: lambda/width, of 1/(2 K mu)", 1 / (2 * 0.5), 3 / (2 * 0.5), lambda);
}

/* --- jamming --------------------------------------------------------------------------------- */

/* Solid fraction at jamming of 1,200 discs, without friction, in a box that is pressed together and
   eased off in steps, from the middle of the box; and the contacts a disc at the least pressure. */
static double jamming(uint64_t seed, double *ends) {
    enum { DISCS = 1200, STEPS = 4 };
    static const double pressures[STEPS] = {1e-3, 1e-4, 3e-5, 1e-5}; /* of kn */
    dem2d_world_desc desc = world_desc(1e-4);
    const dem2d_material_desc material = stone_desc(0, 0);
    desc.local_damping = 0.3, desc.contact_tolerance = 0;
    const double side = sqrt(DISCS * (double)PI / 4 * (0.05 * 0.05 + 0.07 * 0.07) / 2 / 0.6);
    packing p = open_packing(&desc, &material, side, side, WALLS);
    dem2d_shape_id shape;
    dem2d_shape *circle = make_disc(0.025);
    must(dem2d_world_add_shape(p.s.world, circle, &shape), "disc");
    dem2d_shape_destroy(circle);
    random_state = seed;
    const int columns = 35;
    const double pitch = side / columns;
    for (int i = 0; i < DISCS; i++) { /* on a lattice, shaken until nothing is left of it */
        dem2d_particle_desc grain = {0};
        dem2d_particle_id id;
        const double way = uniform(0, (double)(2 * PI));
        grain.scale = random_below(&random_state, 2) ? 1 : 1.4;
        grain.shape = shape, grain.material = p.s.material;
        grain.position = vec((i % columns + 0.5) * pitch, (i / columns + 0.5) * pitch);
        grain.velocity = vec(2 * cos(way), 2 * sin(way));
        must(dem2d_world_add_particle(p.s.world, &grain, &id), "disc");
    }
    set_damping(&p.s, 0);
    step(&p.s, 20000);
    set_damping(&p.s, 0.3);
    double fraction[STEPS];
    for (int i = 0; i < STEPS; i++) {
        control_wall(&p, TOP, DEM2D_WALL_SERVO, pressures[i] * KN, 0.05);
        control_wall(&p, RIGHT, DEM2D_WALL_SERVO, pressures[i] * KN, 0.05);
        step(&p.s, i == 0 ? 100000 : 20000);
        settle(&p, 1e-5, 400000);
        dem2d_box core = inside(&p);
        const double margin = 0.35; /* five of the larger discs: walls order those beside them */
        core.lower.x += margin, core.lower.y += margin;
        core.upper.x -= margin, core.upper.y -= margin;
        fraction[i] = disc_fraction(&p.s, &core);
    }
    const backbone b = find_backbone(&p, 3);
    *ends = 2.0 * (b.contacts + b.wall_contacts) / b.particles;
    close_scene(&p.s);
    /* straight to pressure 0 from the last two */
    return fraction[3] - (fraction[2] - fraction[3]) * pressures[3] / (pressures[2] - pressures[3]);
}

static void bidisperse(void) {
    enum { SAMPLES = 6 };
    double mean = 0, ends = 0;
    for (uint64_t i = 0; i < SAMPLES; i++) {
        double own;
        const double fraction = jamming(61 + i, &own);
        printf("sample %d: solid fraction %.4f, contacts a disc %.3f\n", (int)i + 1, fraction, own);
        fflush(stdout);
        mean += fraction / SAMPLES, ends += own / SAMPLES;
    }
    basis = "literature";
    row_within("bidisperse discs, no friction: solid fraction at jamming", 0.842, mean, 0.005);
    row_between("bidisperse discs, no friction: contacts a disc, no rattlers", 3.95, 4.1, ends);
}

/* --- collapse of a column -------------------------------------------------------------------- */

/* Where the heap ends, from the wall on: at the first piece of 2.5 d with less than half a layer of
   discs. What has rolled away from it does not count. */
static double heap_end(const scene *s) {
    enum { PIECES = 1000 };
    const double piece = 2.5 * MEAN;
    double area[PIECES] = {0};
    int count, end = 0;
    dem2d_particle_id *ids = all_ids(s, &count);
    for (int i = 0; i < count; i++) {
        const dem2d_particle_info info = grain_of(s, ids[i]);
        const double at = info.pose.position.x / piece;
        if (at >= 0 && at < PIECES) area[(int)at] += (double)PI * info.equivalent * info.equivalent;
    }
    free(ids);
    while (end < PIECES && area[end] > 0.5 * piece * (double)PI / 4 * MEAN) end++;
    return end * piece;
}

/* Run-out over width of a column of discs beside a wall, and its aspect: its height is twice that
   of its centre of mass. Grains go on rolling at the end of the heap till 6 sqrt(2 h/g) or so. */
static double collapse(double aspect, double width, double stiffness, uint64_t seed,
                       double *actual) {
    const scene s = open_bin(stiffness, 0.5);
    random_state = seed;
    add_plane(&s, 0, 0, 1, 0), add_floor(&s);
    const dem2d_wall_id gate = add_plane(&s, width, 0, -1, 0);
    pour(&s, unit_disc(&s), (int)(aspect * width * width / disc_area() + 0.5), width, 0);
    run_for(&s, stiffness, 0.6 + 2 * sqrt(aspect * width / G));
    int count;
    double height = 0;
    dem2d_particle_id *ids = all_ids(&s, &count);
    for (int i = 0; i < count; i++) height += 2 * grain_of(&s, ids[i]).pose.position.y / count;
    free(ids);
    must(dem2d_world_remove_wall(s.world, gate), "gate");
    run_for(&s, stiffness, 7 * sqrt(2 * height / G));
    const double end = heap_end(&s);
    close_scene(&s);
    *actual = height / width;
    return (end - width) / width;
}

/* High columns are all 12 d wide: run-out depends on width over d (Warnett et al. 2014, Granular
   Matter 16; Man et al. 2021, Geophys. Res. Lett. 48), so that the exponent of columns of one
   number of grains is too low. Their stiffness grows as their height does, and the overlap at their
   foot does not. Low ones are of 1,500 discs: it is their height that is the lesser. */
static void columns(void) {
    enum { ASPECTS = 3 };
    static const double aspects[2][ASPECTS] = {{0.5, 1, 2}, {4, 8, 16}};
    double exponent[2];
    for (int k = 0; k < 2; k++) {
        double aspect[ASPECTS], run_out[ASPECTS], residual;
        for (int i = 0; i < ASPECTS; i++) {
            const double a = aspects[k][i], low_width = sqrt(1500 * disc_area() / a);
            run_out[i] = 0;
            for (uint64_t seed = 83; seed < 85; seed++)
                run_out[i] += collapse(a, k == 0 ? low_width : 12 * MEAN, fmax(1e6, 1.25e5 * a),
                                       seed, &aspect[i]) /
                              2;
            printf("column of aspect %.3g: run-out/width %.3g\n", aspect[i], run_out[i]);
            fflush(stdout);
        }
        exponent[k] = log_slope(aspect, run_out, ASPECTS, &residual);
    }
    basis = "literature";
    row_within("columns of 1,500 discs, aspect 0.5 to 2: exponent of the run-out", 1, exponent[0],
               0.2);
    row_between("columns 12 d wide, aspect 4 to 16: exponent of the run-out", 0.6, 0.8,
                exponent[1]);
}

int main(int argc, char **argv) {
    static const char *const parts[] = {"hopper", "silo", "jamming", "columns", "gas"};
    example_name = "verify_long";
    bool wanted[COUNT_OF(parts)];
    for (int i = 0; i < COUNT_OF(parts); i++) wanted[i] = argc == 1;
    for (int k = 1; k < argc; k++) {
        bool known = false;
        for (int i = 0; i < COUNT_OF(parts); i++)
            if (strcmp(argv[k], parts[i]) == 0) wanted[i] = known = true;
        if (!known)
            fail(STATUS_BAD_INPUT, "usage: verify_long [hopper] [silo] [jamming] [columns] [gas]");
    }
    if (wanted[0]) table_group("Flow out of a silo"), hopper();
    if (wanted[1]) table_group("Pressure in a silo"), janssen();
    if (wanted[2]) table_group("Jamming"), bidisperse();
    if (wanted[3]) table_group("Collapse of columns"), columns();
    if (wanted[4]) {
        table_group("Energy of gases of polygons, 32 runs");
        basis = "formula";
        gas(K_POLYGON, 32), gas(K_ROUNDED, 32);
    }
    return table_end();
}
