#include "hostile.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include <xxhash.h>

#include "dataset.h"

static void give_up(const char *path)
{
    perror(path);
    abort();
}

static void load(hostile_file *f, const char *path, const char *name)
{
    char file[512];
    struct stat st;
    snprintf(file, sizeof file, "%s/%s", path, name);
    snprintf(f->name, sizeof f->name, "%s", name);
    FILE *in = fopen(file, "rb");
    if (!in || fstat(fileno(in), &st) != 0)
        give_up(file);
    f->bytes = (size_t)st.st_size;
    f->data = malloc(f->bytes);
    if (fread(f->data, 1, f->bytes, in) != f->bytes)
        give_up(file);
    fclose(in);
}

void hostile_load(hostile *h, const char *path)
{
    char name[32];
    load(&h->index, path, TRIP_INDEX_NAME);
    unsigned lists = hostile_header(h)->list_count;
    h->plane_count = 0;
    h->planes = calloc((size_t)TRIP_PLANES * lists, sizeof *h->planes);
    for (unsigned i = 0; i < lists; i++) {
        const trip_file_list *list = hostile_list(h, h, i);
        for (int plane = 0; plane < TRIP_PLANES; plane++) {
            if (!(list->planes >> plane & 1))
                continue;
            hostile_file *f = &h->planes[h->plane_count++];
            load(f, path,
                 trip_plane_file_name((int)list->axis, list->level, (trip_kind)list->kind, plane,
                                      name));
            f->list = i;
            f->plane = plane;
        }
    }
}

static void copy(hostile_file *to, const hostile_file *from)
{
    *to = *from;
    to->data = malloc(from->bytes);
    memcpy(to->data, from->data, from->bytes);
}

void hostile_copy(hostile *to, const hostile *from)
{
    copy(&to->index, &from->index);
    to->plane_count = from->plane_count;
    to->planes = calloc(from->plane_count, sizeof *to->planes);
    for (unsigned i = 0; i < from->plane_count; i++)
        copy(&to->planes[i], &from->planes[i]);
}

void hostile_free(hostile *h)
{
    free(h->index.data);
    for (unsigned i = 0; i < h->plane_count; i++)
        free(h->planes[i].data);
    free(h->planes);
}

/* Stores the checksums of consecutive pages of data[0, bytes) in a table. */
static void sum_pages(const unsigned char *data, size_t bytes, unsigned page_log2,
                      unsigned char *table)
{
    size_t page = (size_t)1 << page_log2;
    for (size_t at = 0; at < bytes; at += page, table += sizeof(uint64_t)) {
        uint64_t sum = XXH64(data + at, bytes - at < page ? bytes - at : page, 0);
        memcpy(table, &sum, sizeof sum);
    }
}

void hostile_seal(hostile *h, const hostile *sound)
{
    const trip_file_header *was = hostile_header(sound);
    unsigned char *index = h->index.data;
    for (unsigned i = 0; i < h->plane_count; i++) {
        const hostile_file *f = &h->planes[i];
        sum_pages(f->data, f->bytes, was->page_log2,
                  index + hostile_list(sound, sound, f->list)->page_checksums_offset[f->plane]);
    }
    sum_pages(index + TRIP_HEADER_BYTES, was->checksums_offset - TRIP_HEADER_BYTES, was->page_log2,
              index + was->checksums_offset);
    trip_file_header *header = hostile_header(h);
    header->checksums_checksum =
        XXH64(index + was->checksums_offset, was->index_bytes - was->checksums_offset, 0);
    header->header_checksum = 0;
    header->header_checksum = XXH64(header, sizeof *header, 0);
}

static void write_file(const hostile_file *f, const char *path)
{
    char file[512];
    snprintf(file, sizeof file, "%s/%s", path, f->name);
    FILE *out = fopen(file, "wb");
    if (!out || fwrite(f->data, 1, f->bytes, out) != f->bytes || fclose(out) != 0)
        give_up(file);
}

static void update(const hostile_file *f, hostile_file *disk, const char *path)
{
    if (disk->data && disk->bytes == f->bytes && memcmp(disk->data, f->data, f->bytes) == 0)
        return;
    write_file(f, path);
    free(disk->data);
    copy(disk, f);
}

void hostile_write(const hostile *h, hostile *disk, const char *path)
{
    if (!disk->planes) {
        if (mkdir(path, 0700) != 0)
            give_up(path);
        disk->plane_count = h->plane_count;
        disk->planes = calloc(h->plane_count, sizeof *disk->planes);
    }
    update(&h->index, &disk->index, path);
    for (unsigned i = 0; i < h->plane_count; i++)
        update(&h->planes[i], &disk->planes[i], path);
}
