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
    dem2di_writer writer;
    memset(&writer, 0, sizeof writer);
    writer.file = fopen(path, "rb"), writer.good = true;
    dem2di_put(&writer, "a");
    *good = writer.good;
    return dem2di_writer_close(NULL, path, &writer);
}

#endif /* DEM2D_IMPLEMENTATION */
#endif
