/* inside.h - what tests see and do inside of a world and of the writers. Include it after dem2d.h;
   it is defined where the implementation is. */
#ifndef INSIDE_H
#define INSIDE_H

/* Where the particle of an index is stored. */
int inside_slot(const dem2d_world *world, int index);
/* Sort the particles in space with the next list, or do not. */
void inside_scatter(dem2d_world *world, bool scattered);
/* Renew the list of pairs in the next step. */
void inside_renew_list(dem2d_world *world);
/* Write to a file that is open for reading only; the result of closing it. */
dem2d_result inside_write_in_vain(const char *path, bool *good);
/* A text with a locale's decimal comma, a comma that is meant, and a number; was all taken? */
bool inside_print_commas(dem2d_write_fn write, void *user);

#ifdef DEM2D_IMPLEMENTATION

int inside_slot(const dem2d_world *world, int index) {
    return world->names[index].slot;
}

void inside_scatter(dem2d_world *world, bool scattered) {
    world->scattered = scattered;
}

void inside_renew_list(dem2d_world *world) {
    world->list_stale = true;
}

dem2d_result inside_write_in_vain(const char *path, bool *good) {
    dem2di_writer writer = {NULL, NULL, fopen(path, "rb"), true};
    dem2di_put(&writer, "a");
    *good = writer.good;
    return dem2di_writer_close(NULL, path, &writer);
}

bool inside_print_commas(dem2d_write_fn write, void *user) {
    dem2di_writer writer = {write, NULL, NULL, true};
    writer.user = user;
    dem2di_print(&writer, "%s", "0,5");
    dem2di_put(&writer, ",");
    dem2di_put_number(&writer, -0.1);
    return writer.good;
}

#endif /* DEM2D_IMPLEMENTATION */
#endif
