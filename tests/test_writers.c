/* Pictures, files for ParaView and histories: what is in them, that VTK reads the same, that every
   failure to write is told, and that no output changes a run. */
#include "dem2d.h"
#include "inside.h"
#include "testing.h"
#include "world_scene.h"

#include <float.h>
#include <limits.h>
#include <locale.h>

/* --- a scene of all that there is ------------------------------------------------------------ */

typedef struct full_scene {
    scene base;
    dem2d_material_id other;
    dem2d_shape_id shapes[3]; /* a disc, a sharp pentagon, an ellipse */
    dem2d_wall_id walls[4];   /* left, right, floor, lid */
} full_scene;

/* Of length 1. */
static dem2d_wall_id put_plane(const full_scene *s, dem2d_vec point, dem2d_vec normal) {
    dem2d_wall_desc wall = plane_desc(&s->base, point, normal);
    wall.length = 1;
    return add_wall(&s->base, &wall);
}

/* An empty world with shapes and materials. */
static void make_scene(full_scene *s, const dem2d_env *env) {
    static const dem2d_vec corners[5] = {
        {-0.9, -0.6}, {0.7, -0.8}, {1.1, 0.1}, {0.4, 0.9}, {-0.6, 0.7}};
    const dem2d_material_desc stone = stone_desc(1e7, 0.4);
    dem2d_world_desc desc = {0};
    memset(s, 0, sizeof *s);
    desc.time_step = 1e-4, desc.gravity.y = -9.81, desc.local_damping = 0.3, desc.env = env;
    s->base = open_scene(&desc, &stone);
    assert_ok(dem2d_world_add_material(s->base.world, &stone, &s->other));
    s->shapes[0] = give_shape(&s->base, make_disc(1));
    s->shapes[1] = give_shape(&s->base, make_polygon(corners, 5, 0));
    s->shapes[2] = give_shape(&s->base, make_ellipse(1, 0.7));
}

/* Grains that fall into a box, one in seven fixed or driven, one removed; ids have gaps. */
static void fill_scene(full_scene *s, int count) {
    dem2d_particle_id id, gone = {0, 0};
    for (int i = 0; i < count; i++) {
        dem2d_particle_desc grain = {0};
        grain.scale = 0.04 + 0.001 * (i % 5), grain.shape = s->shapes[i % 3];
        grain.material = i % 2 ? s->other : s->base.material, grain.angle = i;
        grain.position.x = 0.06 + 0.095 * (i % 5) + 0.004 * (i % 2);
        grain.position.y = 0.05 + 0.09 * (i / 5), grain.velocity.y = -1;
        grain.angular_velocity = i % 4;
        if (i % 7 == 6) grain.motion = DEM2D_DRIVEN, grain.velocity.y = -0.1;
        if (i % 14 == 12) {
            grain.motion = DEM2D_FIXED;
            grain.velocity.y = 0, grain.angular_velocity = 0;
        }
        assert_ok(dem2d_world_add_particle(s->base.world, &grain, &id));
        if (i == 1) gone = id;
    }
    assert_ok(dem2d_world_remove_particle(s->base.world, gone));
    s->walls[0] = put_plane(s, vec(0, 0), vec(1, 0));
    s->walls[1] = put_plane(s, vec(0.5, 0), vec(-1, 0));
    s->walls[2] = put_plane(s, vec(0, 0), vec(0, 1));
    s->walls[3] = put_plane(s, vec(0, 0.9), vec(0.1, -1));
    assert_ok(dem2d_world_remove_wall(s->base.world, s->walls[0]));
    s->walls[0] = put_plane(s, vec(0, 0), vec(2, 0));
}

enum { GRAINS = 40, NUMBERS = 8000 };

/* --- where bytes go -------------------------------------------------------------------------- */

enum { SINK_ROOM = 1 << 20 };

typedef struct sink {
    char text[SINK_ROOM];
    size_t used, room; /* fails when more than room are given */
    int calls, call_room, failures;
} sink;

static sink *sink_start(size_t room, int calls) {
    static sink s;
    s.used = 0, s.room = room, s.calls = 0, s.call_room = calls, s.failures = 0;
    return &s;
}

static bool take(void *user, const char *bytes, size_t count) {
    sink *s = user;
    assert_true(count > 0);
    s->calls++;
    if (s->used + count > s->room || s->calls > s->call_room) {
        s->failures++;
        return false;
    }
    memcpy(s->text + s->used, bytes, count);
    s->used += count;
    s->text[s->used] = '\0';
    return true;
}

/* Every writer, to a callback or a path. */
typedef dem2d_result writer_fn(const dem2d_world *world, dem2d_write_fn *write, void *user,
                               const char *path);

static dem2d_result put_svg(const dem2d_world *world, dem2d_write_fn *write, void *user,
                            const char *path) {
    dem2d_svg_desc desc = {0};
    desc.outline_points = 3, desc.force_chains = true, desc.write = write, desc.user = user;
    return dem2d_world_write_svg(world, &desc, path);
}

static dem2d_result put_part(const dem2d_world *world, dem2d_write_fn *write, void *user,
                             const char *path, dem2d_vtp_part part, int points) {
    dem2d_vtp_desc desc = {0};
    desc.outline_points = points, desc.part = part, desc.write = write, desc.user = user;
    return dem2d_world_write_vtp(world, &desc, path);
}

static dem2d_result put_particles(const dem2d_world *world, dem2d_write_fn *write, void *user,
                                  const char *path) {
    return put_part(world, write, user, path, DEM2D_VTP_PARTICLES, 3);
}

static dem2d_result put_contacts(const dem2d_world *world, dem2d_write_fn *write, void *user,
                                 const char *path) {
    return put_part(world, write, user, path, DEM2D_VTP_CONTACTS, 0);
}

static dem2d_result put_walls(const dem2d_world *world, dem2d_write_fn *write, void *user,
                              const char *path) {
    return put_part(world, write, user, path, DEM2D_VTP_WALLS, 0);
}

static dem2d_result put_cell(const dem2d_world *world, dem2d_write_fn *write, void *user,
                             const char *path) {
    return put_part(world, write, user, path, DEM2D_VTP_CELL, 0);
}

static dem2d_result put_pvd(const dem2d_world *world, dem2d_write_fn *write, void *user,
                            const char *path) {
    static const char *const files[2] = {"a & <b>.vtp", "\"c\" 'd'.vtp"};
    static const double times[2] = {0, 0.1};
    dem2d_pvd_desc desc = {0};
    (void)world;
    desc.count = 2, desc.times = times, desc.files = files, desc.write = write, desc.user = user;
    return dem2d_pvd_write(NULL, &desc, path);
}

static dem2d_result put_csv(const dem2d_world *world, dem2d_write_fn *write, void *user,
                            const char *path) {
    static const char *const names[2] = {"strain", "q/p 1"};
    static const double values[2] = {1.0 / 3, -2e-300};
    dem2d_csv_desc desc = {0};
    desc.count = 2, desc.names = names, desc.values = values, desc.write = write, desc.user = user;
    return dem2d_world_write_csv(world, &desc, path);
}

static writer_fn *const writers[] = {put_svg,  put_particles, put_contacts, put_walls,
                                     put_cell, put_pvd,       put_csv};

/* All that a writer gives, with an end. */
static const char *text_of(writer_fn *writer, const dem2d_world *world) {
    sink *s = sink_start(SINK_ROOM - 1, INT_MAX);
    assert_ok(writer(world, take, s, NULL));
    return s->text;
}

/* --- failures -------------------------------------------------------------------------------- */

/* Each writer fails at every call and every byte, and does not ask again. */
static void test_failing_callbacks(void **state) {
    (void)state;
    test_env env;
    full_scene s;
    test_env_init(&env);
    make_scene(&s, &env.env);
    fill_scene(&s, 7);
    step(&s.base, 400);
    for (int w = 0; w < COUNT_OF(writers); w++) {
        sink *out = sink_start(SINK_ROOM - 1, INT_MAX);
        assert_ok(writers[w](s.base.world, take, out, NULL));
        const size_t bytes = out->used;
        const int calls = out->calls;
        assert_true(calls > 5);
        for (size_t n = 0; n < bytes; n++) {
            out = sink_start(n, INT_MAX);
            assert_result(writers[w](s.base.world, take, out, NULL), DEM2D_IO);
            assert_int_equal(out->failures, 1);
        }
        for (int n = 0; n < calls; n++) {
            out = sink_start(SINK_ROOM - 1, n);
            assert_result(writers[w](s.base.world, take, out, NULL), DEM2D_IO);
            assert_int_equal(out->calls, n + 1);
        }
        if (writers[w] != put_pvd) assert_logged(&env, DEM2D_IO, -1, "callback");
        out = sink_start(bytes, calls);
        assert_ok(writers[w](s.base.world, take, out, NULL));
    }
    dem2d_world_destroy(s.base.world);
    assert_clean(&env);
}

static bool exists(const char *path) {
    FILE *file = fopen(path, "rb");
    if (file) fclose(file);
    return file != NULL;
}

static void test_failing_paths(void **state) {
    (void)state;
    test_env env;
    full_scene s;
    test_env_init(&env);
    make_scene(&s, &env.env);
    fill_scene(&s, 40);
    step(&s.base, 400);
    const bool full = exists("/dev/full"); /* takes bytes into a buffer, then fails */
    for (int w = 0; w < COUNT_OF(writers); w++) {
        test_log_clear(&env);
        assert_result(writers[w](s.base.world, NULL, NULL, "no/such/folder/file"), DEM2D_IO);
        if (writers[w] != put_pvd) assert_logged(&env, DEM2D_IO, -1, "folder");
        assert_result(writers[w](s.base.world, NULL, NULL, NULL), DEM2D_NULL_ARGUMENT);
        assert_result(writers[w](s.base.world, take, NULL, "build/test_writers.none"),
                      DEM2D_OUT_OF_RANGE);
        assert_false(exists("build/test_writers.none"));
        if (!full) continue;
        assert_result(writers[w](s.base.world, NULL, NULL, "/dev/full"), DEM2D_IO);
        if (writers[w] != put_pvd) assert_logged(&env, DEM2D_IO, -1, "full");
    }
    if (full) /* more than any buffer: a write fails before the close */
        assert_result(put_part(s.base.world, NULL, NULL, "/dev/full", DEM2D_VTP_PARTICLES, 2000),
                      DEM2D_IO);
    dem2d_world_destroy(s.base.world);
    assert_clean(&env);
}

/* A write that fails is told of even if the file can be closed. */
static void test_failing_write(void **state) {
    (void)state;
    const char *const path = "build/test_writers.read";
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fclose(file), 0);
    bool good = true;
    assert_result(inside_write_in_vain(path, &good), DEM2D_IO);
    assert_false(good);
    assert_int_equal(remove(path), 0);
}

/* A file's bytes, with an end. */
static char *read_file(const char *path) {
    static char text[SINK_ROOM];
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    const size_t count = fread(text, 1, sizeof text - 1, file);
    assert_int_equal(fclose(file), 0);
    text[count] = '\0';
    return text;
}

/* Files get the bytes that callbacks get, and replace what was there. */
static void test_files(void **state) {
    (void)state;
    const char *const path = "build/test_writers.file";
    full_scene s;
    make_scene(&s, NULL);
    fill_scene(&s, 20);
    step(&s.base, 400);
    for (int w = 0; w < COUNT_OF(writers); w++) {
        assert_ok(writers[w](s.base.world, NULL, NULL, path));
        assert_string_equal(read_file(path), text_of(writers[w], s.base.world));
    }
    assert_int_equal(remove(path), 0);
    dem2d_world_destroy(s.base.world);
}

static void test_null_arguments(void **state) {
    (void)state;
    test_env env;
    full_scene s;
    const dem2d_svg_desc svg = {0};
    const dem2d_vtp_desc vtp = {0};
    const dem2d_csv_desc csv = {0};
    dem2d_vtp_desc wrong = {0};
    test_env_init(&env);
    make_scene(&s, &env.env);
    assert_result(dem2d_world_write_svg(NULL, &svg, "x"), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_world_write_svg(s.base.world, NULL, NULL), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_world_write_vtp(NULL, &vtp, "x"), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_world_write_vtp(s.base.world, NULL, NULL), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_world_write_csv(NULL, &csv, "x"), DEM2D_NULL_ARGUMENT);
    assert_result(dem2d_world_write_csv(s.base.world, NULL, NULL), DEM2D_NULL_ARGUMENT);
    assert_ok(
        dem2d_world_write_vtp(s.base.world, NULL, "build/test_writers_plain.vtp")); /* all zero */
    assert_ok(dem2d_world_write_csv(s.base.world, NULL, "build/test_writers_plain.csv"));
    assert_result(dem2d_pvd_write(&env.env, NULL, "x"), DEM2D_NULL_ARGUMENT);
    assert_logged(&env, DEM2D_NULL_ARGUMENT, -1, "desc");
    for (int points = -1; points <= 2; points++) {
        if (points == 0) continue;
        wrong.outline_points = points;
        assert_result(dem2d_world_write_vtp(s.base.world, &wrong, "x"), DEM2D_OUT_OF_RANGE);
        assert_logged(&env, DEM2D_OUT_OF_RANGE, -1, "outline_points");
    }
    wrong.outline_points = 0;
    for (int part = -1; part <= DEM2D_VTP_PART_COUNT; part += DEM2D_VTP_PART_COUNT + 1) {
        wrong.part = (dem2d_vtp_part)part;
        assert_result(dem2d_world_write_vtp(s.base.world, &wrong, "x"), DEM2D_OUT_OF_RANGE);
        assert_logged(&env, DEM2D_OUT_OF_RANGE, -1, "part");
    }
    assert_false(exists("x"));
    dem2d_world_destroy(s.base.world);
    assert_clean(&env);
}

/* --- the run goes on as if nothing had been asked -------------------------------------------- */

static void ask_everything(const dem2d_world *world) {
    static const dem2d_box region = {{0.1, 0.1}, {0.4, 0.4}};
    dem2d_particle_id ids[100];
    dem2d_contact_info contacts[10];
    dem2d_stats stats;
    dem2d_energy energy;
    dem2d_stress stress;
    dem2d_principal principal;
    dem2d_packing packing;
    dem2d_fabric fabric;
    dem2d_equilibrium rest;
    double number, bins[9], safe, limit;
    int count;
    assert_ok(dem2d_world_stats(world, &stats));
    assert_ok(dem2d_world_particles(world, ids, 100, &count));
    assert_ok(dem2d_world_particle_stress(world, ids[3], &stress));
    assert_ok(dem2d_world_contacts(world, contacts, 10, &count));
    assert_ok(dem2d_world_energy(world, &energy));
    assert_ok(dem2d_world_stress(world, 1, &stress));
    assert_ok(dem2d_stress_principal(&stress, &principal));
    assert_ok(dem2d_world_packing(world, &packing));
    assert_ok(dem2d_world_porosity(world, &region, &number));
    assert_ok(dem2d_world_fabric(world, &fabric));
    for (int i = 0; i < DEM2D_HISTOGRAM_COUNT; i++)
        assert_ok(dem2d_world_histogram(world, (dem2d_histogram)i, 9, bins));
    assert_ok(dem2d_world_equilibrium(world, &rest));
    assert_ok(dem2d_world_inertial_number(world, 1, 1, &number));
    assert_ok(dem2d_world_time_step_bounds(world, &safe, &limit, NULL));
    for (int w = 0; w < COUNT_OF(writers); w++) (void)text_of(writers[w], world);
}

static void test_output_changes_nothing(void **state) {
    (void)state;
    enum { STEPS = 2000 };
    full_scene s[2];
    dem2d_stats stats[2];
    for (int i = 0; i < 2; i++) {
        make_scene(&s[i], NULL);
        fill_scene(&s[i], GRAINS);
        for (int k = 0; k < STEPS; k += 10) {
            step(&s[i].base, 10);
            if (i == 1) ask_everything(s[i].base.world);
        }
        memset(&stats[i], 0, sizeof stats[i]);
        assert_ok(dem2d_world_stats(s[i].base.world, &stats[i]));
    }
    assert_memory_equal(&stats[0], &stats[1], sizeof stats[0]);
    assert_true(stats[0].contacts > 10);
    dem2d_particle_id ids[GRAINS];
    int count;
    assert_ok(dem2d_world_particles(s[0].base.world, ids, GRAINS, &count));
    assert_int_equal(count, GRAINS - 1);
    for (int k = 0; k < count; k++) {
        dem2d_particle_info info[2];
        memset(info, 0, sizeof info);
        for (int i = 0; i < 2; i++)
            assert_ok(dem2d_world_get_particle(s[i].base.world, ids[k], &info[i]));
        assert_memory_equal(&info[0], &info[1], sizeof info[0]);
    }
    static dem2d_contact_info contacts[2][400];
    memset(contacts, 0, sizeof contacts);
    for (int i = 0; i < 2; i++)
        assert_ok(dem2d_world_contacts(s[i].base.world, contacts[i], 400, &count));
    assert_memory_equal(contacts[0], contacts[1], sizeof contacts[0]);
    for (int i = 0; i < 2; i++) dem2d_world_destroy(s[i].base.world);
}

/* --- pictures -------------------------------------------------------------------------------- */

/* Value of an attribute of the tag at `at`. */
static double attribute(const char *at, const char *name) {
    char pattern[40];
    snprintf(pattern, sizeof pattern, " %s=\"", name);
    const char *found = strstr(at, pattern);
    assert_non_null(found);
    return strtod(found + strlen(pattern), NULL);
}

/* Of a disc of radius 1 the picture is 2.2 wide and high, and the bar 0.5 long: under the scene. */
static void test_scale_bar(void **state) {
    (void)state;
    static const double sizes[4] = {1, 0.5e-6, 1e4, 3};
    static const char *const labels[4] = {">0.5 m<", ">2e-07 m<", ">5000 m<", ">1 m<"};
    static const double lengths[4] = {0.5, 2e-7, 5000, 1};
    for (int i = 0; i < 4; i++) {
        full_scene s;
        dem2d_particle_desc grain = {0};
        dem2d_particle_id id;
        make_scene(&s, NULL);
        grain.scale = sizes[i], grain.shape = s.shapes[0], grain.material = s.base.material;
        assert_ok(dem2d_world_add_particle(s.base.world, &grain, &id));
        const dem2d_wall_id gone = put_plane(&s, vec(0, 0), vec(1, 0));
        (void)put_plane(&s, vec(0, 0), vec(1, 2));             /* a line from border to border */
        (void)put_plane(&s, vec(0, -2 * sizes[i]), vec(0, 1)); /* below the picture */
        assert_ok(dem2d_world_remove_wall(s.base.world, gone));
        const char *text = text_of(put_svg, s.base.world),
                   *bar = strstr(text, "<g stroke=\"#222\"");
        assert_non_null(strstr(text, labels[i]));
        assert_non_null(bar);
        assert_within(attribute(bar, "x2") - attribute(bar, "x1"),
                      lengths[i] / sizes[i] / 2.2 * 800, 0.011);
        assert_within(attribute(text, "width"), 800, 0);
        assert_between(attribute(bar, "y1"), 801, attribute(text, "height") - 1);
        assert_int_equal(attribute(bar, "y1") == attribute(bar, "y2"), 1);
        const char *walls = strstr(text, "<g stroke=\"#444\"");
        assert_non_null(walls);
        const char *line = strstr(walls, "<line");
        assert_non_null(line);
        assert_true(line < bar);
        assert_within(fabs(attribute(line, "x1") - attribute(line, "x2")), 800, 0.011);
        assert_within(fabs(attribute(line, "y1") - attribute(line, "y2")), 400, 0.011);
        const char *next = strstr(line + 1, "<line");
        assert_true(next == NULL || next > strstr(line, "</g>")); /* only one is in sight */
        dem2d_world_destroy(s.base.world);
    }
}

/* Files are the same where the decimal sign is a comma, or has two bytes. The Makefile makes these
   locales where the system has their sources. */
static void test_locales(void **state) {
    (void)state;
    static const char *const names[] = {"de_DE.UTF-8", "ps_AF.UTF-8"};
    static char plain[SINK_ROOM];
    char half[32];
    full_scene s;
    make_scene(&s, NULL);
    fill_scene(&s, 12);
    step(&s.base, 300);
    for (int k = 0; k < COUNT_OF(names); k++) {
        if (!setlocale(LC_NUMERIC, names[k])) {
            print_message("skipped: no locale %s\n", names[k]);
            continue;
        }
        snprintf(half, sizeof half, "%.1f", 0.5);
        assert_string_not_equal(half, "0.5");
        for (int i = 0; i < COUNT_OF(writers); i++) {
            setlocale(LC_NUMERIC, "C");
            strcpy(plain, text_of(writers[i], s.base.world));
            setlocale(LC_NUMERIC, names[k]);
            assert_string_equal(text_of(writers[i], s.base.world), plain);
        }
        setlocale(LC_NUMERIC, "C");
    }
    dem2d_world_destroy(s.base.world);
}

/* --- histories ------------------------------------------------------------------------------- */

static const char csv_header[] =
    "step,time,translational,rotational,normal,tangential,rolling,potential,kinetic_ratio,"
    "mean_speed,max_speed,unbalanced,coordination,coordination_loaded,rattlers,contacts,wall_"
    "contacts,"
    "max_overlap";

static void check_row(const full_scene *s, const char *row) {
    dem2d_stats stats;
    dem2d_energy energy;
    dem2d_equilibrium rest;
    dem2d_packing packing;
    assert_ok(dem2d_world_stats(s->base.world, &stats));
    assert_ok(dem2d_world_energy(s->base.world, &energy));
    assert_ok(dem2d_world_equilibrium(s->base.world, &rest));
    assert_ok(dem2d_world_packing(s->base.world, &packing));
    const double expected[] = {(double)stats.steps,
                               (double)stats.steps * 1e-4,
                               energy.translational,
                               energy.rotational,
                               energy.normal,
                               energy.tangential,
                               energy.rolling,
                               energy.potential,
                               rest.kinetic_ratio,
                               rest.mean_speed,
                               rest.max_speed,
                               rest.unbalanced,
                               packing.coordination,
                               packing.coordination_loaded,
                               packing.rattlers,
                               stats.contacts,
                               stats.wall_contacts,
                               packing.max_overlap,
                               1.0 / 3,
                               -2e-300};
    for (int i = 0; i < COUNT_OF(expected); i++) {
        char *end;
        assert_same_bits(strtod(row, &end), expected[i]);
        assert_true(end > row && *end == (i + 1 < COUNT_OF(expected) ? ',' : '\n'));
        row = end + 1;
    }
}

static void test_csv(void **state) {
    (void)state;
    const char *const path = "build/test_writers.csv";
    char header[400];
    full_scene s;
    make_scene(&s, NULL);
    fill_scene(&s, 30);
    snprintf(header, sizeof header, "%s,strain,q/p 1\n", csv_header);
    for (int i = 0; i < 3; i++) {
        const char *text = text_of(put_csv, s.base.world);
        assert_memory_equal(text, header, strlen(header));
        check_row(&s, text + strlen(header)); /* the first is before the first step: inf */
        assert_true(strchr(strchr(text, '\n') + 1, '\n')[1] == '\0'); /* one row */
        step(&s.base, 400);
    }
    dem2d_csv_desc desc = {0};
    for (int i = 0; i < 3; i++) {
        desc.append = i > 0;
        assert_ok(dem2d_world_write_csv(s.base.world, &desc, path));
        step(&s.base, 1);
    }
    const char *text = read_file(path);
    const size_t length = strlen(csv_header);
    assert_memory_equal(text, csv_header, length);
    assert_true(text[length] == '\n');
    double steps[3];
    for (int i = 0; i < 3; i++) {
        text = strchr(text, '\n') + 1;
        steps[i] = strtod(text, NULL);
    }
    assert_true(steps[0] == 1200 && steps[1] == 1201 && steps[2] == 1202);
    assert_true(strchr(text, '\n')[1] == '\0');
    assert_int_equal(remove(path), 0);
    dem2d_world_destroy(s.base.world);
}

static void check_refused(const full_scene *s, const test_env *env, const dem2d_csv_desc *desc,
                          dem2d_result result, int index, const char *word) {
    sink *out = sink_start(SINK_ROOM - 1, INT_MAX);
    dem2d_csv_desc with = *desc;
    with.write = take, with.user = out;
    assert_result(dem2d_world_write_csv(s->base.world, &with, NULL), result);
    assert_logged(env, result, index, word);
    assert_int_equal(out->calls, 0);
}

/* --- pictures of large, strayed and driven scenes ------------------------------------------------
 */

/* Attributes of the elements that begin with some text, one after the other; false at the end. */
static bool next_element(const char **at, const char *start) {
    const char *found = strstr(*at, start);
    if (found) *at = found + strlen(start);
    return found != NULL;
}

static int count_of(const char *text, const char *start) {
    int count = 0;
    for (const char *at = text; next_element(&at, start);) count++;
    return count;
}

static const char *svg_text(const dem2d_world *world, dem2d_svg_desc desc) {
    const char *const path = "build/test_writers_picture.svg";
    assert_ok(dem2d_world_write_svg(world, &desc, path));
    const char *text = read_file(path);
    assert_int_equal(remove(path), 0);
    return text;
}

/* Discs of radius 1 in rows that overlap a little, one row on a floor. */
static void make_rows(full_scene *s, int columns, int rows) {
    make_scene(s, NULL);
    dem2d_shape *disc = make_disc(1);
    dem2d_shape_id shape;
    assert_ok(dem2d_world_add_shape(s->base.world, disc, &shape));
    dem2d_shape_destroy(disc);
    for (int i = 0; i < columns * rows; i++) {
        dem2d_particle_desc grain = {0};
        dem2d_particle_id id;
        grain.scale = 1, grain.shape = shape, grain.material = s->base.material;
        grain.position = vec(1.99 * (i % columns), 1.99 * (i / columns) + 0.99);
        assert_ok(dem2d_world_add_particle(s->base.world, &grain, &id));
    }
}

/* Lines of forces are narrower than grains, however many there are. */
static void test_chain_width(void **state) {
    (void)state;
    for (int columns = 2; columns <= 200; columns *= 10) {
        const dem2d_svg_desc desc = {.force_chains = true};
        full_scene s;
        make_rows(&s, columns, 2);
        step(&s.base, 1);
        const char *text = svg_text(s.base.world, desc), *at = text;
        const double radius = attribute(text, "r");
        double sum = 0;
        int lines = 0;
        assert_true(next_element(&at, "stroke-linecap"));
        while (next_element(&at, "<line ")) {
            if (strstr(at, "</svg>") > strstr(at, "<text")) break; /* the scale bar */
            const double width = attribute(at, "stroke-width");
            assert_true(width > 0 && width <= radius + 0.01);
            sum += width, lines++;
        }
        assert_true(lines >= 3 * columns - 2);
        assert_near(sum / lines, fmin(800 / 400, radius / 4), 0.02L);
        dem2d_world_destroy(s.base.world);
    }
}

/* One stray grain shrinks everything, unless a view is given: what is off it is not drawn. */
static void test_view(void **state) {
    (void)state;
    full_scene s;
    dem2d_svg_desc desc = {0};
    make_rows(&s, 10, 1);
    const char *text = svg_text(s.base.world, desc);
    const double radius = attribute(text, "r");
    dem2d_particle_desc stray = {0};
    dem2d_particle_id id;
    dem2d_particle_id all[16];
    dem2d_particle_info info;
    int count;
    assert_ok(dem2d_world_particles(s.base.world, all, 16, &count));
    assert_ok(dem2d_world_get_particle(s.base.world, all[0], &info));
    stray.shape = info.shape, stray.material = s.base.material, stray.scale = 1;
    stray.position = vec(3000, 3000);
    assert_ok(dem2d_world_add_particle(s.base.world, &stray, &id));
    text = svg_text(s.base.world, desc);
    assert_true(attribute(text, "r") < radius / 50);
    assert_int_equal(count_of(text, "<circle"), 11);
    desc.view.lower = vec(-1, 0), desc.view.upper = vec(19, 2);
    text = svg_text(s.base.world, desc);
    assert_int_equal(count_of(text, "<circle"), 10);
    assert_within(attribute(text, "r"), 800 / 20.0, 0.01);
    const dem2d_box bad[] = {
        {{0, 0}, {0, 1}}, {{0, 0}, {1, 0}}, {{1, 1}, {0, 0}}, {{0, 0}, {NAN, 1}}};
    for (int i = 0; i < COUNT_OF(bad); i++) {
        desc.view = bad[i];
        assert_result(dem2d_world_write_svg(s.base.world, &desc, "build/none.svg"),
                      i == 3 ? DEM2D_NOT_FINITE : DEM2D_OUT_OF_RANGE);
    }
    dem2d_world_destroy(s.base.world);
}

/* Half-planes beside the grains are drawn; one far away is not. */
static void test_walls_beside(void **state) {
    (void)state;
    const double below[] = {0, 1, 6, 100};
    for (int i = 0; i < COUNT_OF(below); i++) {
        full_scene s;
        make_rows(&s, 10, 1);
        dem2d_wall_desc wall = {0};
        dem2d_wall_id id;
        wall.material = s.base.material, wall.normal = vec(0, 1), wall.point = vec(7, -below[i]);
        assert_ok(dem2d_world_add_wall(s.base.world, &wall, &id));
        const dem2d_svg_desc desc = {0};
        const int with = count_of(svg_text(s.base.world, desc), "<line ");
        assert_ok(dem2d_world_remove_wall(s.base.world, id));
        assert_int_equal(with - count_of(svg_text(s.base.world, desc), "<line "), below[i] <= 6);
        dem2d_world_destroy(s.base.world);
    }
}

static void test_motions_shown(void **state) {
    (void)state;
    full_scene s;
    dem2d_particle_id all[8];
    dem2d_particle_info info;
    int count;
    make_rows(&s, 4, 1);
    assert_ok(dem2d_world_particles(s.base.world, all, 8, &count));
    assert_ok(dem2d_world_get_particle(s.base.world, all[0], &info));
    for (int motion = DEM2D_FIXED; motion <= DEM2D_DRIVEN; motion++) {
        dem2d_particle_desc grain = {0};
        dem2d_particle_id id;
        grain.shape = info.shape, grain.material = s.base.material, grain.scale = 1;
        grain.position = vec(3.0 * motion, 5), grain.motion = (dem2d_motion)motion;
        assert_ok(dem2d_world_add_particle(s.base.world, &grain, &id));
    }
    const dem2d_svg_desc desc = {0};
    const char *text = svg_text(s.base.world, desc);
    assert_int_equal(count_of(text, "<circle"), 6);
    assert_int_equal(count_of(text, "fill=\"#8c8c8c\""), 1);
    assert_int_equal(count_of(text, "fill=\"url(#dem2d-driven)\""), 1);
    assert_ok(
        dem2d_world_write_svg(s.base.world, NULL, "build/test_writers_plain.svg")); /* all zero */
    assert_string_equal(read_file("build/test_writers_plain.svg"), svg_text(s.base.world, desc));
    assert_int_equal(remove("build/test_writers_plain.svg"), 0);
    dem2d_world_destroy(s.base.world);
}

/* --- colours -------------------------------------------------------------------------------------
 */

/* The fill of the grain whose centre is the n-th from the left of a row that was made so. */
static const char *fill_of(const char *text, int n) {
    static char fill[8];
    const char *at = text;
    for (int i = 0; i <= n; i++) assert_true(next_element(&at, "<circle"));
    at = strstr(at, "fill=\"");
    assert_non_null(at);
    memcpy(fill, at + 6, 7);
    return fill;
}

/* How light a colour is, 0 to 255. */
static double lightness(const char *fill) {
    unsigned r, g, b;
    assert_int_equal(sscanf(fill, "#%02x%02x%02x", &r, &g, &b), 3);
    return 0.3 * r + 0.59 * g + 0.11 * b;
}

/* Speeds of 0 to 9 m/s: ever lighter, from one end of the bar to the other; a range that is given;
   what is off the view does not count. */
static void test_colour_bar(void **state) {
    (void)state;
    full_scene s;
    dem2d_particle_id all[16];
    dem2d_svg_desc desc = {0};
    char low[8], high[8];
    int count;
    make_rows(&s, 10, 1);
    assert_ok(dem2d_world_particles(s.base.world, all, 16, &count));
    for (int i = 0; i < 10; i++) set_velocity(&s.base, all[i], DEM2D_FREE, vec(0, i), 0);
    step(&s.base, 1), step(&s.base, 1);
    desc.colour = DEM2D_COLOUR_SPEED;
    const char *text = svg_text(s.base.world, desc);
    assert_non_null(strstr(text, ">speed, m/s</text>"));
    strcpy(low, fill_of(text, 0)), strcpy(high, fill_of(text, 9));
    assert_string_equal(low, "#261e5c"), assert_string_equal(high, "#fde74c");
    for (int i = 1; i < 10; i++) {
        const double before = lightness(fill_of(text, i - 1));
        assert_true(lightness(fill_of(text, i)) > before + 5);
    }
    desc.low = 4, desc.high = 5;
    text = svg_text(s.base.world, desc);
    assert_non_null(strstr(text, ">4</text>")), assert_non_null(strstr(text, ">5</text>"));
    for (int i = 0; i < 10; i++)
        if (i != 4 && i != 5) assert_string_equal(fill_of(text, i), i < 5 ? low : high);
    desc.low = desc.high = 0;
    desc.view.lower = vec(-1, 0), desc.view.upper = vec(5, 2); /* grains 0 to 3 */
    text = svg_text(s.base.world, desc);
    assert_string_equal(fill_of(text, 3), high);
    desc.colour = DEM2D_COLOUR_PRESSURE, desc.label = "a < b";
    text = svg_text(s.base.world, desc);
    assert_non_null(strstr(text, ">a &lt; b</text>"));
    dem2d_world_destroy(s.base.world);
}

/* Values go by dem2d_world_particles, also when grains have left and have names that order them
   otherwise. */
static void test_colour_values(void **state) {
    (void)state;
    full_scene s;
    dem2d_particle_id all[16];
    dem2d_particle_info info;
    dem2d_svg_desc desc = {0};
    double values[8];
    int count;
    make_rows(&s, 6, 1);
    assert_ok(dem2d_world_particles(s.base.world, all, 16, &count));
    assert_ok(dem2d_world_get_particle(s.base.world, all[0], &info));
    assert_ok(dem2d_world_remove_particle(s.base.world, all[2]));
    dem2d_particle_desc grain = {0};
    dem2d_particle_id id;
    grain.shape = info.shape, grain.material = s.base.material, grain.scale = 1, grain.name = 1;
    grain.position = vec(30, 1); /* in the free id, drawn by its name */
    assert_ok(dem2d_world_add_particle(s.base.world, &grain, &id));
    assert_ok(dem2d_world_remove_particle(s.base.world, all[4]));
    assert_ok(dem2d_world_particles(s.base.world, all, 16, &count));
    assert_int_equal(count, 5);
    for (int i = 0; i < count; i++) {
        dem2d_particle_info at;
        assert_ok(dem2d_world_get_particle(s.base.world, all[i], &at));
        values[i] = at.pose.position.x;
    }
    desc.colour = DEM2D_COLOUR_VALUES, desc.values = values, desc.value_count = count;
    const char *text = svg_text(s.base.world, desc), *at = text;
    double light[8], x[8];
    for (int i = 0; i < count; i++) {
        assert_true(next_element(&at, "<circle"));
        x[i] = attribute(at, "cx"), light[i] = lightness(strstr(at, "fill=\"") + 6);
    }
    for (int i = 0; i < count; i++)
        for (int k = 0; k < count; k++)
            if (x[i] < x[k]) assert_true(light[i] < light[k]);
    desc.value_count = 4;
    assert_result(dem2d_world_write_svg(s.base.world, &desc, "build/none.svg"), DEM2D_OUT_OF_RANGE);
    desc.value_count = 5, values[3] = NAN;
    assert_result(dem2d_world_write_svg(s.base.world, &desc, "build/none.svg"), DEM2D_NOT_FINITE);
    desc.values = NULL;
    assert_result(dem2d_world_write_svg(s.base.world, &desc, "build/none.svg"),
                  DEM2D_NULL_ARGUMENT);
    values[3] = 0, desc.values = values, desc.low = 2, desc.high = 2;
    assert_result(dem2d_world_write_svg(s.base.world, &desc, "build/none.svg"), DEM2D_OUT_OF_RANGE);
    desc.high = 3, desc.label = "a\nb";
    assert_result(dem2d_world_write_svg(s.base.world, &desc, "build/none.svg"), DEM2D_OUT_OF_RANGE);
    dem2d_world_destroy(s.base.world);
}

/* Materials and groups have a key of those that are drawn. */
static void test_colour_classes(void **state) {
    (void)state;
    full_scene s;
    dem2d_particle_id all[16];
    dem2d_svg_desc desc = {0};
    int count;
    make_rows(&s, 4, 1);
    assert_ok(dem2d_world_particles(s.base.world, all, 16, &count));
    dem2d_groups groups = {0};
    groups.category = 1u << 31;
    assert_ok(dem2d_world_set_groups(s.base.world, all[1], groups));
    groups.category = 12; /* bits 2 and 3 */
    assert_ok(dem2d_world_set_groups(s.base.world, all[2], groups));
    desc.colour = DEM2D_COLOUR_GROUP;
    const char *text = svg_text(s.base.world, desc);
    assert_non_null(strstr(text, ">group</text>"));
    assert_non_null(strstr(text, ">2</text>")), assert_non_null(strstr(text, ">31</text>"));
    assert_null(strstr(text, ">3</text>")), assert_null(strstr(text, ">0</text>"));
    assert_string_equal(fill_of(text, 0), "#c9c9c9");
    assert_string_equal(fill_of(text, 1), "#b0a27e");
    assert_string_equal(fill_of(text, 2), "#b9a3d6");
    desc.colour = DEM2D_COLOUR_MATERIAL;
    text = svg_text(s.base.world, desc);
    assert_non_null(strstr(text, ">material</text>"));
    assert_non_null(strstr(text, ">0</text>"));
    dem2d_world_destroy(s.base.world);
}

/* --- time ----------------------------------------------------------------------------------------
 */

/* Of all steps, each with the time step that it had; saved and loaded. */
static void test_time(void **state) {
    (void)state;
    const char *const path = "build/test_writers.snapshot";
    const double steps[] = {1e-5, 1e-6, 1e-6, 3e-5, 1e-5};
    full_scene s;
    dem2d_stats n;
    long double time = 0;
    double before = -1;
    make_scene(&s, NULL);
    for (int i = 0; i < COUNT_OF(steps); i++) {
        assert_ok(dem2d_world_set_time_step(s.base.world, steps[i]));
        for (int k = 0; k < 3; k++) {
            step(&s.base, 1000 + k);
            time += (long double)steps[i] * (1000 + k);
            assert_ok(dem2d_world_stats(s.base.world, &n));
            assert_near(n.time, time, 1e-15L);
            assert_true(n.time > before);
            before = n.time;
            const char *row = strchr(text_of(put_csv, s.base.world), '\n') + 1;
            assert_same_bits(strtod(strchr(row, ',') + 1, NULL), n.time);
        }
        dem2d_world *loaded = NULL;
        const uint64_t hash = dem2d_world_hash(s.base.world);
        assert_ok(dem2d_world_save(s.base.world, &(dem2d_save_desc){0}, path));
        assert_ok(dem2d_world_load(NULL, path, &loaded));
        assert_true(dem2d_world_hash(loaded) == hash);
        dem2d_world_destroy(s.base.world);
        s.base.world = loaded;
        assert_ok(dem2d_world_stats(s.base.world, &n));
        assert_same_bits(n.time, before);
    }
    assert_int_equal(remove(path), 0);
    dem2d_world_destroy(s.base.world);
}

static void test_csv_errors(void **state) {
    (void)state;
    static const char *const bad[] = {"a,b", "a\"b", "a\nb", "a\rb", ","};
    const char *names[2] = {"good", NULL};
    double values[2] = {1, 2};
    test_env env;
    full_scene s;
    dem2d_csv_desc desc = {0};
    test_env_init(&env);
    make_scene(&s, &env.env);
    desc.count = -1;
    check_refused(&s, &env, &desc, DEM2D_OUT_OF_RANGE, -1, "count");
    desc.count = 2;
    check_refused(&s, &env, &desc, DEM2D_NULL_ARGUMENT, -1, "names");
    desc.names = names;
    check_refused(&s, &env, &desc, DEM2D_NULL_ARGUMENT, -1, "values");
    desc.values = values;
    check_refused(&s, &env, &desc, DEM2D_NULL_ARGUMENT, 1, "names");
    for (int i = 0; i < COUNT_OF(bad); i++) {
        names[1] = bad[i];
        check_refused(&s, &env, &desc, DEM2D_OUT_OF_RANGE, 1, "names");
        desc.append = !desc.append;
    }
    names[1] = "b", values[0] = NAN;
    check_refused(&s, &env, &desc, DEM2D_NOT_FINITE, 0, "values");
    values[0] = 1, values[1] = INFINITY;
    check_refused(&s, &env, &desc, DEM2D_NOT_FINITE, 1, "values");
    dem2d_world_destroy(s.base.world);
    assert_clean(&env);
}

/* --- collections ----------------------------------------------------------------------------- */

static void test_pvd(void **state) {
    (void)state;
    assert_string_equal(
        text_of(put_pvd, NULL),
        "<?xml version=\"1.0\"?>\n"
        "<VTKFile type=\"Collection\" version=\"0.1\" byte_order=\"LittleEndian\">\n"
        "<Collection>\n"
        "<DataSet timestep=\"0\" group=\"\" part=\"0\" file=\"a &amp; &lt;b&gt;.vtp\"/>\n"
        "<DataSet timestep=\"0.10000000000000001\" group=\"\" part=\"0\" "
        "file=\"&quot;c&quot; &apos;d&apos;.vtp\"/>\n"
        "</Collection>\n</VTKFile>\n");
}

static void test_pvd_errors(void **state) {
    (void)state;
    const char *files[2] = {"a.vtp", "b\x1f.vtp"};
    double times[2] = {0, 1};
    test_env env;
    dem2d_pvd_desc desc = {0};
    test_env_init(&env);
    sink *out = sink_start(SINK_ROOM - 1, INT_MAX);
    desc.write = take, desc.user = out, desc.count = -1;
    assert_result(dem2d_pvd_write(&env.env, &desc, NULL), DEM2D_OUT_OF_RANGE);
    assert_logged(&env, DEM2D_OUT_OF_RANGE, -1, "count");
    desc.count = 2;
    assert_result(dem2d_pvd_write(&env.env, &desc, NULL), DEM2D_NULL_ARGUMENT);
    assert_logged(&env, DEM2D_NULL_ARGUMENT, -1, "files");
    desc.files = files;
    assert_result(dem2d_pvd_write(&env.env, &desc, NULL), DEM2D_NULL_ARGUMENT);
    assert_logged(&env, DEM2D_NULL_ARGUMENT, -1, "times");
    desc.times = times;
    for (char c = 1; c < 32; c++) {
        const char name[] = {'b', c, 0};
        files[1] = name;
        assert_result(dem2d_pvd_write(&env.env, &desc, NULL), DEM2D_OUT_OF_RANGE);
        assert_logged(&env, DEM2D_OUT_OF_RANGE, 1, "files");
    }
    files[1] = "b.vtp", times[1] = NAN;
    assert_result(dem2d_pvd_write(&env.env, &desc, NULL), DEM2D_NOT_FINITE);
    assert_logged(&env, DEM2D_NOT_FINITE, 1, "times");
    assert_int_equal(out->calls, 0);
    desc.count = 0, desc.files = NULL, desc.times = NULL;
    assert_ok(dem2d_pvd_write(NULL, &desc, NULL)); /* an empty series */
    assert_null(strstr(out->text, "DataSet"));
}

/* --- VTK's files, read here ------------------------------------------------------------------ */

/* Numbers of the array of a name; returns how many. */
static int read_array(const char *text, const char *name, double *numbers, int room) {
    char pattern[60];
    int count = 0;
    snprintf(pattern, sizeof pattern, " Name=\"%s\"", name);
    const char *at = strstr(text, pattern);
    assert_non_null(at);
    for (at = strchr(at, '>') + 1; count < room; count++) {
        char *end;
        const double number = strtod(at, &end);
        if (end == at) break;
        numbers[count] = number, at = end;
    }
    at += strspn(at, "\n");
    assert_memory_equal(at, "</DataArray>", 12);
    return count;
}

static double numbers[NUMBERS];

/* The array has these components for each of count cells, and for cell i these values. */
static void check_cell(const char *text, const char *name, int cell, int cells, int components,
                       const double *expected) {
    assert_int_equal(read_array(text, name, numbers, NUMBERS), cells * components);
    for (int k = 0; k < components; k++)
        assert_same_bits(numbers[cell * components + k], expected[k] + 0.0); /* no -0 */
}

#define CHECK_CELL(name, ...)                                                         \
    do {                                                                              \
        const double check_expected[] = {__VA_ARGS__};                                \
        check_cell(text, (name), i, count, COUNT_OF(check_expected), check_expected); \
    } while (0)

/* Grains before and after a step: contacts and stresses are those of the poses before it. */
static void test_vtp_particles(void **state) {
    (void)state;
    static char text[SINK_ROOM];
    full_scene s;
    dem2d_particle_id ids[GRAINS];
    dem2d_particle_info before[GRAINS];
    static dem2d_contact_info contacts[400];
    int count, open, of[GRAINS] = {0}, first = 0;
    make_scene(&s, NULL);
    fill_scene(&s, GRAINS);
    step(&s.base, 900);
    assert_ok(dem2d_world_particles(s.base.world, ids, GRAINS, &count));
    for (int i = 0; i < count; i++)
        assert_ok(dem2d_world_get_particle(s.base.world, ids[i], &before[i]));
    step(&s.base, 1);
    assert_ok(dem2d_world_contacts(s.base.world, contacts, 400, &open));
    for (int i = 0; i < open; i++)
        if (contacts[i].b.generation != 0) of[contacts[i].a.index]++, of[contacts[i].b.index]++;
    strcpy(text, text_of(put_particles, s.base.world));
    for (int i = 0; i < count; i++) {
        const dem2d_particle_info *p = &before[i];
        const dem2d_shape *shape = dem2d_world_shape(s.base.world, p->shape);
        dem2d_particle_info now;
        dem2d_shape_info info;
        dem2d_stress stress;
        assert_ok(dem2d_world_get_particle(s.base.world, ids[i], &now));
        assert_ok(dem2d_shape_get(shape, &info));
        assert_ok(dem2d_world_particle_stress(s.base.world, ids[i], &stress));
        CHECK_CELL("id", ids[i].index);
        CHECK_CELL("type", info.type);
        CHECK_CELL("material", p->material.index);
        CHECK_CELL("motion", p->motion);
        CHECK_CELL("contacts", of[ids[i].index]);
        CHECK_CELL("velocity", 0.5 * (p->velocity.x + now.velocity.x),
                   0.5 * (p->velocity.y + now.velocity.y), 0);
        CHECK_CELL("angular_velocity", 0.5 * (p->angular_velocity + now.angular_velocity));
        CHECK_CELL("angle", dem2d_rot_angle(p->pose.rotation));
        CHECK_CELL("mass", p->mass);
        CHECK_CELL("radius", p->equivalent);
        CHECK_CELL("stress", stress.xx, stress.xy, 0, stress.yx, stress.yy, 0, 0, 0, 0);
        const int points = info.type == DEM2D_POLYGON ? info.count : 3;
        dem2d_vec outline[8];
        assert_ok(dem2d_shape_outline(shape, p->pose, points, outline));
        assert_true(read_array(text, "offsets", numbers, NUMBERS) == count);
        assert_true(numbers[i] == first + points);
        (void)read_array(text, "Points", numbers, NUMBERS);
        for (int k = 0; k < points; k++, first++) {
            assert_same_bits(numbers[3 * first], outline[k].x);
            assert_same_bits(numbers[3 * first + 1], outline[k].y);
            assert_true(numbers[3 * first + 2] == 0);
        }
    }
    assert_int_equal(read_array(text, "connectivity", numbers, NUMBERS), first);
    for (int k = 0; k < first; k++) assert_true(numbers[k] == k);
    dem2d_world_destroy(s.base.world);
}

static void test_vtp_contacts(void **state) {
    (void)state;
    static char text[SINK_ROOM];
    static dem2d_contact_info contacts[400];
    full_scene s;
    int count, two = 0, walls = 0, rolls = 0;
    const dem2d_pair_desc rough = {.normal_stiffness = 1e7,
                                   .tangential_stiffness = 1e7,
                                   .friction = 0.4,
                                   .rolling_friction = 0.05};
    make_scene(&s, NULL);
    fill_scene(&s, GRAINS);
    step(&s.base, 7900); /* rolling friction earlier would keep faces from meeting */
    assert_ok(dem2d_world_set_pair(s.base.world, s.base.material, s.other, &rough));
    for (int tries = 0; two == 0 && tries < 200; tries++) { /* until some meet */
        step(&s.base, 100);
        assert_ok(dem2d_world_contacts(s.base.world, contacts, 400, &count));
        for (int i = 0; i < count; i++) two += contacts[i].points == 2;
    }
    strcpy(text, text_of(put_contacts, s.base.world));
    for (int i = 0; i < count; i++) {
        const dem2d_contact_info *c = &contacts[i];
        const bool wall = c->b.generation == 0;
        const dem2d_vec n = c->normal, t = {-n.y, n.x};
        CHECK_CELL("a", c->a.index);
        CHECK_CELL("b", wall ? -1 : (double)c->b.index);
        CHECK_CELL("wall", wall ? (double)c->wall.index : -1);
        CHECK_CELL("points", c->points);
        CHECK_CELL("normal", n.x, n.y, 0);
        CHECK_CELL("position", c->point.x, c->point.y, 0);
        CHECK_CELL("normal_force", c->normal_force);
        CHECK_CELL("tangential_force", c->tangential_force);
        CHECK_CELL("moment", c->moment);
        CHECK_CELL("depth", c->depth);
        assert_int_equal(read_array(text, "force", numbers, NUMBERS), 3 * count);
        const double size = fabs(c->normal_force) + fabs(c->tangential_force);
        assert_within(numbers[3 * i], c->normal_force * n.x + c->tangential_force * t.x,
                      1e-15 * size);
        assert_within(numbers[3 * i + 1], c->normal_force * n.y + c->tangential_force * t.y,
                      1e-15 * size);
        assert_int_equal(read_array(text, "Points", numbers, NUMBERS), 6 * count);
        assert_near(numbers[6 * i + 3] - numbers[6 * i], c->branch.x, 1e-9);
        assert_near(numbers[6 * i + 4] - numbers[6 * i + 1], c->branch.y, 1e-9);
        if (wall) assert_within(numbers[6 * i + 3], c->point.x, 1e-15);
        walls += wall, rolls += c->moment != 0;
    }
    assert_true(count > 20 && two > 0 && walls > 0 && rolls > 0);
    dem2d_world_destroy(s.base.world);
}

/* A disc of radius 1, so a box from -1.1 to 1.1, and walls that cross it or do not. */
static void test_vtp_walls(void **state) {
    (void)state;
    static const double at[4][4] = {
        {0, -0.99, 0, 1}, {0.5, 0.3, -1, 0}, {0, 0, 1, 1}, {5, 0, -1, 0}};
    static const double ends[4][4] = {{1.1, -0.99, -1.1, -0.99},
                                      {0.5, 1.1, 0.5, -1.1},
                                      {1.1, -1.1, -1.1, 1.1},
                                      {5, 1.1, 5, -1.1}};
    full_scene s;
    dem2d_particle_desc grain = {0};
    dem2d_particle_id id;
    enum { count = 5 };
    make_scene(&s, NULL);
    grain.scale = 1, grain.shape = s.shapes[0], grain.material = s.base.material;
    grain.motion = DEM2D_FREE;
    assert_ok(dem2d_world_add_particle(s.base.world, &grain, &id));
    const dem2d_wall_id gone = put_plane(&s, vec(0, 0), vec(1, 0)); /* leaves a gap among the ids */
    for (int i = 0; i < 4; i++)
        s.walls[i] = put_plane(&s, vec(at[i][0], at[i][1]), vec(at[i][2], at[i][3]));
    dem2d_wall_desc moving = {0};
    moving.mode = DEM2D_WALL_MOVING, moving.material = s.base.material, moving.normal = vec(0, -1);
    moving.point = vec(0, 3), moving.velocity = vec(0.5, -2);
    dem2d_wall_id last;
    assert_ok(dem2d_world_add_wall(s.base.world, &moving, &last));
    assert_ok(dem2d_world_remove_wall(s.base.world, gone));
    step(&s.base, 1);
    const char *text = text_of(put_walls, s.base.world);
    for (int i = 0; i < 4; i++) {
        dem2d_wall_info info;
        assert_ok(dem2d_world_get_wall(s.base.world, s.walls[i], &info));
        CHECK_CELL("id", s.walls[i].index);
        CHECK_CELL("mode", 0);
        CHECK_CELL("velocity", 0, 0, 0);
        CHECK_CELL("stress", info.stress);
        CHECK_CELL("force", info.force.x, info.force.y, 0);
        assert_int_equal(read_array(text, "Points", numbers, NUMBERS), 6 * count);
        for (int k = 0; k < 2; k++) {
            assert_within(numbers[6 * i + 3 * k], ends[i][2 * k], 1e-14);
            assert_within(numbers[6 * i + 3 * k + 1], ends[i][2 * k + 1], 1e-14);
        }
    }
    const int i = 4;
    CHECK_CELL("mode", DEM2D_WALL_MOVING);
    CHECK_CELL("velocity", 0.5, -2, 0);
    assert_true(read_array(text, "force", numbers, NUMBERS) > 0 && numbers[1] < -9e4);
    dem2d_world_destroy(s.base.world);
}

/* Numbers that are not normal are written as 0. */
static void test_vtp_tiny(void **state) {
    (void)state;
    full_scene s;
    dem2d_particle_desc grain = {0};
    dem2d_particle_id id;
    make_scene(&s, NULL);
    grain.scale = 1, grain.shape = s.shapes[0], grain.material = s.base.material;
    grain.velocity = vec(1e-310, -DBL_MIN);
    assert_ok(dem2d_world_add_particle(s.base.world, &grain, &id));
    const char *text = text_of(put_particles, s.base.world);
    const int i = 0, count = 1;
    CHECK_CELL("velocity", 0, -DBL_MIN, 0);
    dem2d_world_destroy(s.base.world);
}

/* --- pictures and files of periodic cells ---------------------------------------------------- */

/* Discs of radius 0.5: the first two touch across the left border, the last crosses the upper one,
   the third is in the middle. */
static const double cell_places[4][2] = {{0.25, 1.5}, {3.375, 1.5}, {2, 1.5}, {2, 2.875}};

static scene open_cell(dem2d_vec a, dem2d_vec b) {
    const dem2d_material_desc stone = stone_desc(1e7, 0.4);
    dem2d_world_desc desc = {0};
    dem2d_particle_id id;
    desc.time_step = 1e-4, desc.cell.a = a, desc.cell.b = b;
    scene s = open_scene(&desc, &stone);
    const dem2d_shape_id disc = give_shape(&s, make_disc(1));
    for (int i = 0; i < 4; i++) {
        dem2d_particle_desc grain = {0};
        grain.scale = 0.5, grain.shape = disc, grain.material = s.material;
        grain.position = vec(cell_places[i][0], cell_places[i][1]);
        assert_ok(dem2d_world_add_particle(s.world, &grain, &id));
    }
    step(&s, 1);
    return s;
}

/* The file has these images, and besides the particles no other: id, shift_a, shift_b of each. */
static void check_images(const scene *s, const int (*images)[3], int count, dem2d_vec a,
                         dem2d_vec b) {
    static char text[SINK_ROOM];
    static double id[64], image[64], along_a[64], along_b[64];
    int particles = 0, found = 0;
    strcpy(text, text_of(put_particles, s->world));
    assert_int_equal(read_array(text, "id", id, 64), 4 + count);
    assert_int_equal(read_array(text, "image", image, 64), 4 + count);
    assert_int_equal(read_array(text, "shift_a", along_a, 64), 4 + count);
    assert_int_equal(read_array(text, "shift_b", along_b, 64), 4 + count);
    assert_int_equal(read_array(text, "Points", numbers, NUMBERS), 9 * (4 + count));
    for (int i = 0; i < 4 + count; i++) {
        const double *place = cell_places[(int)id[i]], *p = numbers + 9 * i;
        particles += image[i] == 0;
        assert_int_equal(image[i] != 0, along_a[i] != 0 || along_b[i] != 0);
        for (int k = 0; k < count; k++)
            found += image[i] == 1 && id[i] == images[k][0] && along_a[i] == images[k][1] &&
                     along_b[i] == images[k][2];
        assert_within((p[0] + p[3] + p[6]) / 3, place[0] + along_a[i] * a.x + along_b[i] * b.x,
                      1e-14);
        assert_within((p[1] + p[4] + p[7]) / 3, place[1] + along_b[i] * b.y, 1e-14);
    }
    assert_int_equal(particles, 4);
    assert_int_equal(found, count);
}

/* The contact across the border leads from the particle to an image; it is there once. */
static void check_across(const scene *s, double period) {
    const char *text = text_of(put_contacts, s->world);
    double ends[6], a, b, along_a, along_b;
    assert_int_equal(read_array(text, "Points", ends, 6), 6);
    assert_int_equal(read_array(text, "a", &a, 1), 1);
    assert_int_equal(read_array(text, "b", &b, 1), 1);
    assert_int_equal(read_array(text, "shift_a", &along_a, 1), 1);
    assert_int_equal(read_array(text, "shift_b", &along_b, 1), 1);
    assert_true(a + b == 1 && fabs(along_a) == 1 && along_b == 0);
    assert_within(ends[0], cell_places[(int)a][0], 1e-14);
    assert_within(ends[3], cell_places[(int)b][0] + along_a * period, 1e-14);
    assert_within(fabs(ends[3] - ends[0]), 0.875, 1e-14);
    assert_within(ends[1], 1.5, 1e-14);
    assert_within(ends[4], 1.5, 1e-14);
}

/* The lines of the border: their number, and that each with its period is on the opposite one. */
static void check_border(const scene *s, int count, double *ends) {
    const char *text = text_of(put_cell, s->world);
    double period[12];
    assert_int_equal(count_of(text, "NumberOfPolys=\"0\""), 1);
    assert_int_equal(read_array(text, "id", period, 12), count);
    for (int i = 0; i < count; i++) assert_true(period[i] == i);
    assert_int_equal(read_array(text, "period", period, 12), 3 * count);
    assert_int_equal(read_array(text, "Points", ends, 24), 6 * count);
    for (int i = 0; i < count; i++) {
        const double *from = ends + 6 * i, *to = ends + 6 * (i ^ 1), *p = period + 3 * i;
        const double along[2] = {to[3] - to[0], to[4] - to[1]};
        const double off[2] = {from[0] + p[0] - to[0], from[1] + p[1] - to[1]};
        assert_true(hypot(p[0], p[1]) > 0);
        assert_within(along[0] * off[1] - along[1] * off[0], 0, 1e-13);
    }
}

static void check_cell_picture(const scene *s, int circles, int lines, const char *path) {
    dem2d_svg_desc desc = {0};
    assert_ok(dem2d_world_write_svg(s->world, &desc, path));
    const char *text = svg_text(s->world, desc);
    assert_int_equal(count_of(text, "<circle"), circles);
    const char *border = strstr(text, "<g stroke=\"#1f5fa8\">");
    assert_int_equal(border != NULL, lines > 0);
    if (lines == 0) return;
    int drawn = 0;
    for (border = strchr(border, '>') + 2; strncmp(border, "<line", 5) == 0; drawn++)
        border = strchr(border, '\n') + 1;
    assert_int_equal(drawn, lines);
}

/* A rectangle, and an oblique cell whose corners show more images. */
static void test_cell_both(void **state) {
    (void)state;
    static const int images[3][3] = {{0, 1, 0}, {1, -1, 0}, {3, 0, -1}};
    const dem2d_vec a = vec(4, 0);
    double ends[24];
    scene s = open_cell(a, vec(0, 3));
    check_images(&s, images, 3, a, vec(0, 3));
    check_across(&s, 4);
    check_border(&s, 4, ends);
    assert_within(ends[3] - ends[0], 4, 1e-14);
    assert_within(ends[7] - ends[1], 3, 1e-14);
    check_cell_picture(&s, 7, 4, "build/test_writers_both.svg");
    close_scene(&s);
    s = open_cell(a, vec(1, 3));
    check_border(&s, 4, ends);
    const double expected[4][4] = {{0, 0, 4, 0}, {1, 3, 5, 3}, {0, 0, 1, 3}, {4, 0, 5, 3}};
    for (int i = 0; i < 4; i++)
        for (int k = 0; k < 4; k++)
            assert_within(ends[6 * i + k % 2 + 3 * (k / 2)], expected[i][k], 1e-14);
    /* the first is moved into the cell, to x = 4.25, and has an image at the left; the last has
       images at both lower corners; the margin shows one of the second */
    assert_int_equal(read_array(text_of(put_particles, s.world), "image", ends, 24), 7);
    check_cell_picture(&s, 8, 4, "build/test_writers_oblique.svg");
    close_scene(&s);
}

/* Periodic one way: two lines across the scene. A grain far above does not widen the picture. */
static void test_cell_one_way(void **state) {
    (void)state;
    static const int along_a[2][3] = {{0, 1, 0}, {1, -1, 0}}, along_b[1][3] = {{3, 0, -1}};
    const dem2d_vec a = vec(4, 0), b = vec(0, 3), none = vec(0, 0);
    double ends[24];
    scene s = open_cell(a, none);
    check_images(&s, along_a, 2, a, none);
    check_across(&s, 4);
    check_border(&s, 2, ends);
    for (int i = 0; i < 2; i++) {
        assert_within(ends[6 * i], 4.0 * i, 1e-14);
        assert_within(ends[6 * i + 3], 4.0 * i, 1e-14);
        assert_true(ends[6 * i + 1] < 1 && ends[6 * i + 4] > 3.375);
    }
    check_cell_picture(&s, 6, 2, "build/test_writers_one_way.svg");
    dem2d_particle_desc stray = {0};
    dem2d_particle_info info;
    dem2d_particle_id ids[4], id;
    int count;
    assert_ok(dem2d_world_particles(s.world, ids, 4, &count));
    assert_ok(dem2d_world_get_particle(s.world, ids[0], &info));
    stray.shape = info.shape, stray.material = s.material, stray.scale = 0.5;
    stray.position = vec(2, 400);
    assert_ok(dem2d_world_add_particle(s.world, &stray, &id));
    check_cell_picture(&s, 7, 2, "build/test_writers_high.svg");
    close_scene(&s);
    s = open_cell(none, b);
    check_images(&s, along_b, 1, none, b);
    check_border(&s, 2, ends);
    for (int i = 0; i < 2; i++) {
        assert_within(ends[6 * i + 1], 3.0 * i, 1e-14);
        assert_within(ends[6 * i + 4], 3.0 * i, 1e-14);
        assert_true(ends[6 * i] < -0.25 && ends[6 * i + 3] > 3.875);
    }
    check_cell_picture(&s, 5, 2, "build/test_writers_along_b.svg");
    close_scene(&s);
}

/* Without a cell: no array of images, no border. */
static void test_cell_none(void **state) {
    (void)state;
    static writer_fn *const parts[2] = {put_particles, put_contacts};
    double ends[24];
    scene s = open_cell(vec(0, 0), vec(0, 0));
    for (int i = 0; i < 2; i++) {
        assert_null(strstr(text_of(parts[i], s.world), "shift_"));
        assert_null(strstr(text_of(parts[i], s.world), "image"));
    }
    check_border(&s, 0, ends);
    check_cell_picture(&s, 4, 0, "build/test_writers_none.svg");
    close_scene(&s);
}

/* --- VTK's files, read by VTK ---------------------------------------------------------------- */

/* What the reader of VTK makes of a .vtp file is what its text says; of a .pvd file, that what it
   names is there and that its times rise. */
static const char script[] =
    "import os, sys, xml.etree.ElementTree as tree\n"
    "def fail(caller, event): raise SystemExit('VTK reports an error')\n"
    "def numbers(array): return [float(t) for t in (array.text or '').split()]\n"
    "def vtp(path):\n"
    "    from vtkmodules.vtkIOXML import vtkXMLPolyDataReader\n"
    "    root = tree.parse(path).getroot()\n"
    "    assert (root.tag, root.get('type'), root.get('version')) == ('VTKFile', 'PolyData', "
    "'1.0')\n"
    "    piece = root.find('PolyData/Piece')\n"
    "    reader = vtkXMLPolyDataReader()\n"
    "    assert reader.CanReadFile(path)\n"
    "    reader.AddObserver('ErrorEvent', fail)\n"
    "    reader.SetFileName(path)\n"
    "    reader.Update()\n"
    "    out, data = reader.GetOutput(), reader.GetOutput().GetCellData()\n"
    "    counts = [out.GetNumberOfPoints(), out.GetNumberOfLines(), out.GetNumberOfPolys(),\n"
    "              out.GetNumberOfVerts()]\n"
    "    names = ('Points', 'Lines', 'Polys', 'Verts')\n"
    "    assert counts == [int(piece.get('NumberOf' + n)) for n in names], counts\n"
    "    cells = out.GetNumberOfCells()\n"
    "    arrays = piece.findall('CellData/DataArray')\n"
    "    assert data.GetNumberOfArrays() == len(arrays) > 4\n"
    "    for array in arrays:\n"
    "        got, width = data.GetArray(array.get('Name')), int(array.get('NumberOfComponents'))\n"
    "        kind = {'Int32': ('int', 4), 'Float64': ('double', 8)}[array.get('type')]\n"
    "        assert (got.GetDataTypeAsString(), got.GetDataTypeSize()) == kind\n"
    "        assert got.GetNumberOfComponents() == width and got.GetNumberOfTuples() == cells\n"
    "        assert [got.GetValue(i) for i in range(cells * width)] == numbers(array)\n"
    "    points = [c for i in range(counts[0]) for c in out.GetPoint(i)]\n"
    "    assert points == numbers(piece.find('Points/DataArray'))\n"
    "    first = 0\n"
    "    for i in range(cells):\n"
    "        ids = out.GetCell(i).GetPointIds()\n"
    "        got = [ids.GetId(k) for k in range(ids.GetNumberOfIds())]\n"
    "        assert len(got) >= 2 and got == list(range(first, first + len(got)))\n"
    "        first += len(got)\n"
    "    assert first == counts[0]\n"
    "    return cells\n"
    "def vti(path):\n"
    "    from vtkmodules.vtkIOXML import vtkXMLImageDataReader\n"
    "    root = tree.parse(path).getroot()\n"
    "    image = root.find('ImageData')\n"
    "    reader = vtkXMLImageDataReader()\n"
    "    assert reader.CanReadFile(path)\n"
    "    reader.AddObserver('ErrorEvent', fail)\n"
    "    reader.SetFileName(path)\n"
    "    reader.Update()\n"
    "    out, data = reader.GetOutput(), reader.GetOutput().GetCellData()\n"
    "    arrays = image.findall('Piece/CellData/DataArray')\n"
    "    cells = out.GetNumberOfCells()\n"
    "    assert cells == 12 and data.GetNumberOfArrays() == len(arrays) == 10\n"
    "    for array in arrays:\n"
    "        got, width = data.GetArray(array.get('Name')), int(array.get('NumberOfComponents'))\n"
    "        assert got.GetNumberOfComponents() == width and got.GetNumberOfTuples() == cells\n"
    "        assert [got.GetValue(i) for i in range(cells * width)] == numbers(array)\n"
    "    expected = [float(t) for t in open(path + '.txt').read().split()]\n"
    "    for i in range(cells):\n"
    "        box = out.GetCell(i).GetBounds()\n"
    "        for k in range(2):\n"
    "            assert abs((box[2 * k] + box[2 * k + 1]) / 2 - expected[2 * i + k]) < 1e-12\n"
    "    return cells\n"
    "def pvd(path):\n"
    "    root = tree.parse(path).getroot()\n"
    "    assert (root.tag, root.get('type')) == ('VTKFile', 'Collection')\n"
    "    sets = root.findall('Collection/DataSet')\n"
    "    times = [float(s.get('timestep')) for s in sets]\n"
    "    assert len(times) == 3 and times == sorted(set(times))\n"
    "    for s in sets:\n"
    "        assert tree.parse(os.path.join(os.path.dirname(path), s.get('file')))\n"
    "for path in sys.argv[1:]:\n"
    "    print(path, {'.pvd': pvd, '.vtp': vtp, '.vti': vti}[path[-4:]](path))\n";

/* A python3 that has a module, or NULL. */
static const char *find_python(const char *module) {
    static const char *const pythons[] = {"python3", "/usr/bin/python3"};
    char command[200];
    for (int i = 0; i < COUNT_OF(pythons); i++) {
        snprintf(command, sizeof command, "%s -c 'import %s' > /dev/null 2>&1", pythons[i], module);
        if (system(command) == 0) return pythons[i];
    }
    return NULL;
}

static void run_script(const char *python, const char *files) {
    char command[600];
    FILE *file = fopen("build/test_writers.py", "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(script, 1, sizeof script - 1, file), sizeof script - 1);
    assert_int_equal(fclose(file), 0);
    snprintf(command, sizeof command, "%s build/test_writers.py %s > build/test_writers.said 2>&1",
             python, files);
    if (system(command) != 0) {
        print_error("%s", read_file("build/test_writers.said"));
        fail();
    }
    remove("build/test_writers.py");
    remove("build/test_writers.said");
}

/* Scenes with and without cells. */
static void test_vtk_reads(void **state) {
    (void)state;
    static const dem2d_vtp_part parts[3] = {DEM2D_VTP_PARTICLES, DEM2D_VTP_CONTACTS,
                                            DEM2D_VTP_WALLS};
    char files[600] = "";
    full_scene s[2];
    const char *python = find_python("vtkmodules.vtkIOXML");
    if (python == NULL) skip();
    for (int i = 0; i < 2; i++) {
        make_scene(&s[i], NULL);
        if (i == 1) fill_scene(&s[i], GRAINS);
        step(&s[i].base, 900);
        for (int k = 0; k < 3; k++) {
            char path[60];
            snprintf(path, sizeof path, "build/test_writers_%d_%d.vtp", i, k);
            assert_ok(put_part(s[i].base.world, NULL, NULL, path, parts[k], 0));
            strcat(strcat(files, " "), path);
        }
        dem2d_world_destroy(s[i].base.world);
    }
    run_script(python, files);
    for (char *path = strtok(files, " "); path != NULL; path = strtok(NULL, " ")) remove(path);
}

/* The fields of a grid, turned and not: cells where dem2d_grid_read says they are. */
static void test_vti_reads(void **state) {
    (void)state;
    const char *python = find_python("vtkmodules.vtkIOXML");
    if (python == NULL) skip();
    full_scene s;
    make_scene(&s, NULL);
    fill_scene(&s, GRAINS);
    step(&s.base, 900);
    for (int turned = 0; turned < 2; turned++) {
        dem2d_grid_desc desc = {0};
        dem2d_average cells[12];
        dem2d_grid *grid;
        int count;
        desc.nx = 4, desc.ny = 3, desc.box.upper = vec(1, 0.8), desc.width_x = 0.2;
        desc.angle = turned ? 0.5 : 0;
        assert_ok(dem2d_grid_create(NULL, &desc, &grid));
        assert_ok(dem2d_grid_add(grid, s.base.world, 1));
        assert_ok(dem2d_grid_read(grid, cells, 12, &count));
        assert_ok(dem2d_grid_write_vti(grid, NULL, "build/test_writers.vti"));
        FILE *file = fopen("build/test_writers.vti.txt", "w");
        assert_non_null(file);
        for (int i = 0; i < count; i++)
            fprintf(file, "%.17g %.17g\n", cells[i].centre.x, cells[i].centre.y);
        assert_int_equal(fclose(file), 0);
        run_script(python, "build/test_writers.vti");
        dem2d_grid_destroy(grid);
    }
    remove("build/test_writers.vti"), remove("build/test_writers.vti.txt");
    dem2d_world_destroy(s.base.world);
}

/* A series whose names need escapes. */
static void test_pvd_names(void **state) {
    (void)state;
    static const char *const names[3] = {"test_writers 0.vtp", "test_writers <&\"'>;.vtp",
                                         "test_writers \xc3\xa9.vtp"};
    static const double times[3] = {-1, 0.1, 1e9};
    char path[60];
    full_scene s;
    dem2d_pvd_desc desc = {0};
    const char *python = find_python("xml");
    if (python == NULL) skip();
    make_scene(&s, NULL);
    for (int i = 0; i < 3; i++) {
        snprintf(path, sizeof path, "build/%s", names[i]);
        assert_ok(put_particles(s.base.world, NULL, NULL, path));
    }
    desc.count = 3, desc.files = names, desc.times = times;
    assert_ok(dem2d_pvd_write(NULL, &desc, "build/test_writers.pvd"));
    run_script(python, "build/test_writers.pvd");
    for (int i = 0; i < 3; i++) {
        snprintf(path, sizeof path, "build/%s", names[i]);
        assert_int_equal(remove(path), 0);
    }
    assert_int_equal(remove("build/test_writers.pvd"), 0);
    dem2d_world_destroy(s.base.world);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_failing_callbacks),
        cmocka_unit_test(test_failing_paths),
        cmocka_unit_test(test_failing_write),
        cmocka_unit_test(test_files),
        cmocka_unit_test(test_null_arguments),
        cmocka_unit_test(test_output_changes_nothing),
        cmocka_unit_test(test_scale_bar),
        cmocka_unit_test(test_locales),
        cmocka_unit_test(test_csv),
        cmocka_unit_test(test_chain_width),
        cmocka_unit_test(test_view),
        cmocka_unit_test(test_walls_beside),
        cmocka_unit_test(test_motions_shown),
        cmocka_unit_test(test_colour_bar),
        cmocka_unit_test(test_colour_values),
        cmocka_unit_test(test_colour_classes),
        cmocka_unit_test(test_time),
        cmocka_unit_test(test_csv_errors),
        cmocka_unit_test(test_pvd),
        cmocka_unit_test(test_pvd_errors),
        cmocka_unit_test(test_vtp_particles),
        cmocka_unit_test(test_vtp_contacts),
        cmocka_unit_test(test_vtp_walls),
        cmocka_unit_test(test_vtp_tiny),
        cmocka_unit_test(test_cell_both),
        cmocka_unit_test(test_cell_one_way),
        cmocka_unit_test(test_cell_none),
        cmocka_unit_test(test_vtk_reads),
        cmocka_unit_test(test_vti_reads),
        cmocka_unit_test(test_pvd_names),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
