/* fuzz_snapshot.c - dem2d_world_load against any bytes; most get a right checksum, so that what is
   behind it is reached. A world that is taken is stepped, changed, hashed, and saved and loaded
   again.

       clang -fsanitize=fuzzer,address,undefined   libFuzzer: fuzz_snapshot [CORPUS]
       cc -DFUZZ_MAIN -fsanitize=address,undefined fuzz_snapshot [N [SEED]]: N random changes of
                                                   small snapshots (20000, 1), the same each time
                                                   fuzz_snapshot FOLDER: writes those there
*/
#define _POSIX_C_SOURCE 200809L
#define DEM2D_IMPLEMENTATION
#include "dem2d.h"
#include "snapshot_scenes.h"

enum { HEAD = DEM2DI_SNAPSHOT_HEAD, TAIL = DEM2DI_SNAPSHOT_TAIL, ROOM = 1 << 16 };

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* Ends the program when a promise of the library does not hold. */
static void promise(bool holds) {
    if (!holds) abort();
}

/* Memory that is counted, and has an end: what a small snapshot takes must be little. */
typedef struct meter {
    size_t bytes, most;
    int blocks;
} meter;

static void *meter_allocate(void *user, size_t size) {
    meter *m = user;
    if (size > m->most - m->bytes) return NULL;
    m->bytes += size, m->blocks++;
    return malloc(size);
}

static void meter_release(void *user, void *memory, size_t size) {
    meter *m = user;
    m->bytes -= size, m->blocks--;
    free(memory);
}

static void put_word(uint8_t *bytes, uint64_t word) {
    for (int k = 0; k < 8; k++) bytes[k] = (uint8_t)(word >> 8 * k & 255);
}

/* Mark, version, size and checksum as they should be. */
static void make_right(uint8_t *bytes, size_t size) {
    if (size < HEAD + TAIL) return;
    put_word(bytes, DEM2DI_SNAPSHOT_MARK);
    put_word(bytes + 8, DEM2DI_SNAPSHOT_VERSION);
    put_word(bytes + 16, size);
    uint64_t checksum = DEM2DI_HASH_START;
    for (size_t k = 0; k + 8 <= size - TAIL; k += 8)
        checksum = dem2di_hash_word(checksum, dem2di_word_of(bytes + k));
    put_word(bytes + size - TAIL, checksum);
}

/* What a caller may do to a world. Results do not matter. */
static void use(dem2d_world *world) {
    dem2d_particle_id ids[4], added;
    dem2d_energy energy;
    dem2d_packing packing;
    dem2d_particle_desc grain = {.scale = 1};
    dem2d_wall_desc bar = {.segment = true, .end = {0.03, 0.01}};
    dem2d_wall_id wall = {0, 1};
    const dem2d_deformation_desc flow = {.xy = 0.5, .yy = -0.1};
    dem2d_cell_info cell;
    int count = 0;
    (void)dem2d_world_step(world, 2, NULL);
    (void)dem2d_world_energy(world, &energy);
    promise(dem2d_world_get_cell(world, &cell) == DEM2D_OK);
    (void)dem2d_world_packing(world, &packing);
    promise(dem2d_world_particles(world, ids, 4, &count) == DEM2D_OK);
    for (int i = 0; i < count && i < 4; i++) {
        dem2d_particle_info info;
        promise(dem2d_world_get_particle(world, ids[i], &info) == DEM2D_OK);
        grain.shape = info.shape, grain.material = info.material;
        grain.position = info.pose.position;
    }
    (void)dem2d_world_add_particle(world, &grain, &added);
    (void)dem2d_world_remove_wall(world, wall);
    bar.material = grain.material;
    (void)dem2d_world_add_wall(world, &bar, &wall);
    (void)dem2d_world_deform(world, &flow);
    if (count > 0) (void)dem2d_world_remove_particle(world, ids[0]);
    (void)dem2d_world_step(world, 2, NULL);
}

static void try_load(const uint8_t *data, size_t size) {
    meter memory = {0, (size_t)64 << 20, 0};
    dem2d_env env = {&memory, meter_allocate, meter_release, NULL};
    scene_bytes from = {(char *)(uintptr_t)data, size, size, 0, 0};
    dem2d_custom_desc custom;
    dem2d_load_desc desc = scene_load_desc(&from, &custom);
    dem2d_world *world = NULL;
    desc.env = &env;
    const dem2d_result result = dem2d_world_load(&desc, NULL, &world);
    promise((result == DEM2D_OK) == (world != NULL));
    if (world != NULL) {
        const uint64_t hash = dem2d_world_hash(world);
        scene_bytes saved = scene_save(world);
        dem2d_world *again = NULL;
        desc = scene_load_desc(&saved, &custom);
        desc.env = &env;
        promise(dem2d_world_load(&desc, NULL, &again) == DEM2D_OK);
        promise(dem2d_world_hash(again) == hash);
        dem2d_world_destroy(again);
        free(saved.bytes);
        use(world);
        (void)dem2d_world_hash(world);
        dem2d_world_destroy(world);
    }
    promise(memory.bytes == 0 && memory.blocks == 0);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    try_load(data, size);
    uint8_t *right = malloc(size > 0 ? size : 1); /* the sanitizers see its end */
    if (right == NULL) abort();
    memcpy(right, data, size);
    make_right(right, size);
    try_load(right, size);
    free(right);
    return 0;
}

#if defined(FUZZ_MAIN)

typedef struct sample {
    uint8_t *bytes;
    size_t size;
} sample;

enum { IN_BOX, ON_FLOOR, UNDER_SERVO, CELLS, SCENES = SCENE_COUNT + CELLS, SAMPLES = 2 * SCENES };

static const char *const cell_names[CELLS] = {"box", "floor", "servo"};

/* Walls in a cell: a closed chain that turns across the corner, with a fixed bar, while the cell
   shears; a one-sided floor that goes round under gravity; the same with a servo segment above. */
static void add_cell_walls(dem2d_world *world, int kind, dem2d_material_id stone) {
    static const dem2d_vec box[4] = {{-0.02, -0.02}, {0.02, -0.02}, {0.02, 0.02}, {-0.02, 0.02}};
    static const dem2d_vec ground[3] = {{0.05, 0.01}, {0.12, 0.03}, {0.25, 0.01}};
    dem2d_wall_desc chain = {.material = stone, .points = box, .count = 4, .closed = true};
    dem2d_wall_desc bar = {.material = stone, .segment = true};
    dem2d_wall_id id;
    chain.mode = DEM2D_WALL_MOVING, chain.angular_velocity = 3;
    bar.point = (dem2d_vec){0.15, 0.1}, bar.end = (dem2d_vec){0.23, 0.12};
    if (kind != IN_BOX) {
        chain.points = ground, chain.count = 3, chain.closed = false, chain.one_sided = true;
        chain.mode = DEM2D_WALL_STILL, chain.angular_velocity = 0;
    }
    if (kind == UNDER_SERVO) {
        bar.mode = DEM2D_WALL_SERVO, bar.stress = 500, bar.max_speed = 1;
        bar.point = (dem2d_vec){0.18, 0.15}, bar.end = (dem2d_vec){0.02, 0.15};
    }
    scene_check(dem2d_world_add_wall(world, &chain, &id));
    scene_check(dem2d_world_add_wall(world, &bar, &id));
}

/* Discs and rounded boxes across the border of such a cell. */
static dem2d_world *make_cell(int kind) {
    static const dem2d_vec corners[4] = {{0, 0}, {0.04, 0}, {0.04, 0.03}, {0, 0.03}};
    const dem2d_material_desc stone = material_desc(2700, 1e6, 1e6, 0.5);
    const dem2d_deformation_desc shear = {.xy = 2};
    dem2d_world_desc desc = {.time_step = 1e-4, .ledger = true, .cell = {.a = {0.2, 0}}};
    dem2d_particle_desc grain = {.scale = 1};
    dem2d_shape *shapes[2];
    dem2d_shape_id ids[2];
    dem2d_world *world;
    if (kind == IN_BOX) desc.cell.b = (dem2d_vec){0.03, 0.2};
    if (kind != IN_BOX) desc.gravity.y = -9.81;
    scene_check(dem2d_world_create(&desc, &world));
    scene_check(dem2d_world_add_material(world, &stone, &grain.material));
    scene_check(dem2d_shape_create_circle(NULL, 0.02, &shapes[0]));
    scene_check(dem2d_shape_create_polygon(NULL, corners, 4, 0.004, &shapes[1]));
    for (int k = 0; k < 2; k++) {
        scene_check(dem2d_world_add_shape(world, shapes[k], &ids[k]));
        dem2d_shape_destroy(shapes[k]);
    }
    add_cell_walls(world, kind, grain.material);
    for (int i = 0; i < (kind == IN_BOX ? 16 : 6); i++) {
        dem2d_particle_id id;
        grain.shape = ids[i % 2], grain.angle = i;
        grain.position = (dem2d_vec){0.05 * (i % 4), 0.06 + 0.05 * (i / 4)};
        grain.velocity = (dem2d_vec){0.5 - 0.2 * i, -1.5 + 0.3 * (i % 3)};
        scene_check(dem2d_world_add_particle(world, &grain, &id));
    }
    if (kind == IN_BOX) scene_check(dem2d_world_deform(world, &shear));
    return world;
}

static dem2d_world *make_world(int scene) {
    snapshot_scene s;
    if (scene >= SCENE_COUNT) return make_cell(scene - SCENE_COUNT);
    const dem2d_world_desc desc = scene_desc(scene);
    scene_make(&s, scene, 5, &desc);
    return s.world;
}

/* Each scene at rest in its list, and with one just removed. */
static void make_samples(sample samples[SAMPLES]) {
    for (int i = 0; i < SAMPLES; i++) {
        dem2d_world *world = make_world(i / 2);
        dem2d_particle_id id = {1, 1};
        dem2d_stats stats;
        scene_check(dem2d_world_step(world, 220, NULL));
        scene_check(dem2d_world_stats(world, &stats));
        promise(stats.contacts + stats.wall_contacts > 0 || i < 2 * SCENE_COUNT);
        if (i % 2 == 1) scene_check(dem2d_world_remove_particle(world, id));
        scene_bytes bytes = scene_save(world);
        samples[i].bytes = (uint8_t *)bytes.bytes;
        samples[i].size = bytes.size;
        promise(bytes.size <= ROOM);
        dem2d_world_destroy(world);
    }
}

static size_t below(uint64_t *random, size_t count) {
    return (size_t)(random_bits(random) % count);
}

/* One random change of what is between head and tail. */
static size_t change(uint8_t *bytes, size_t size, const sample *samples, uint64_t *random) {
    static const double doubles[] = {0,      -0.0, 1,    -1,       1e300,     -1e300, 1e-300,
                                     5e-324, 1e-9, 1e12, HUGE_VAL, -HUGE_VAL, NAN,    0.5};
    static const int32_t ints[] = {0, 1, 2, 3, -1, -2, 255, 256, INT32_MAX, INT32_MIN, 1 << 30};
    if (size < HEAD + TAIL + 200) return size;
    size_t at = HEAD + below(random, size - HEAD - TAIL - 80), few = 8 * (1 + below(random, 9));
    if (below(random, 2) == 0) at -= at % 8; /* all is in words of 8 bytes */
    switch (below(random, 7)) {
    case 0:
        bytes[at] ^= (uint8_t)(1 << below(random, 8));
        break;
    case 1:
        bytes[at] = (uint8_t)random_bits(random);
        break;
    case 2: {
        uint64_t word;
        memcpy(&word, &doubles[below(random, sizeof doubles / sizeof *doubles)], 8);
        put_word(bytes + at, word);
        break;
    }
    case 3: {
        const uint32_t word = (uint32_t)ints[below(random, sizeof ints / sizeof *ints)];
        for (int k = 0; k < 4; k++) bytes[at + (size_t)k] = (uint8_t)(word >> 8 * k & 255);
        break;
    }
    case 4: /* a few words gone */
        memmove(bytes + at, bytes + at + few, size - at - few);
        return size - few;
    case 5: /* a few more */
        if (size + few > ROOM) break;
        memmove(bytes + at + few, bytes + at, size - at);
        return size + few;
    case 6: { /* a part of another, or of itself elsewhere */
        const sample *other = &samples[below(random, SAMPLES)];
        size_t count = 1 + below(random, 200);
        if (count > size - at) count = size - at;
        if (other->size <= count) break;
        memcpy(bytes + at, other->bytes + below(random, other->size - count), count);
        break;
    }
    default:
        break;
    }
    return size;
}

static void write_samples(const sample *samples, const char *folder) {
    for (int i = 0; i < SAMPLES; i++) {
        char path[512];
        const int cell = i / 2 - SCENE_COUNT;
        snprintf(path, sizeof path, "%s/%s-%d", folder,
                 cell < 0 ? scene_names[i / 2] : cell_names[cell], i % 2);
        FILE *file = fopen(path, "wb");
        promise(file != NULL &&
                fwrite(samples[i].bytes, 1, samples[i].size, file) == samples[i].size);
        promise(fclose(file) == 0);
    }
}

int main(int count, char **arguments) {
    static uint8_t bytes[ROOM];
    sample samples[SAMPLES];
    char *end = "";
    const unsigned long runs = count > 1 ? strtoul(arguments[1], &end, 10) : 20000;
    uint64_t random = count > 2 ? strtoull(arguments[2], NULL, 10) : 1;
    make_samples(samples);
    if (*end != '\0') write_samples(samples, arguments[1]);
    for (unsigned long run = 0; *end == '\0' && run < runs; run++) {
        const sample *start = &samples[below(&random, SAMPLES)];
        size_t size = start->size;
        memcpy(bytes, start->bytes, size);
        for (size_t n = 1 + below(&random, 4); n > 0; n--)
            size = change(bytes, size, samples, &random);
        uint8_t *exact = malloc(size);
        promise(exact != NULL);
        memcpy(exact, bytes, size);
        LLVMFuzzerTestOneInput(exact, size);
        free(exact);
    }
    for (int i = 0; i < SAMPLES; i++) free(samples[i].bytes);
    if (*end == '\0') printf("fuzz_snapshot: %lu inputs, all handled\n", runs);
    return 0;
}

#endif
