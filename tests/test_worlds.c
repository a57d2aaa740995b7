/* Features used together: the first worlds of the campaign fuzz-worlds, see random_worlds.h. */
#include "dem2d.h"
#include "inside.h"
#include "testing.h"

#include "random_worlds.h"

static void test_random_worlds(void **state) {
    (void)state;
    const int count = test_long() ? 2000 : 150;
    uint64_t met = 0;
    for (int i = 0; i < count; i++) {
        char fault[FAULT_ROOM];
        uint64_t features;
        if (!world_check(1, i, &features, fault)) {
            print_error("seed 1 world %d: %s\n", i, fault);
            fail();
        }
        met |= features;
    }
    for (int k = 0; k < WITH_COUNT; k++) {
        if (!(met >> k & 1)) print_error("no world with %s\n", world_features[k]);
        assert_true((met >> k & 1) == 1);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_random_worlds)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
