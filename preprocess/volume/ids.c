#include "ids.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "report.h"

enum { FIRST_ROOM = 1024 };

/* Minimum part of the voxels of a label that equal the voxel before. Objects of two voxels across
 * have this part. Measured values have far less, apart from the background. */
static const double equal_part = 0.5;
/* At least this part of the keys must be such labels. Too few keys are labels in any case. */
static const double label_part = 0.5;
enum { FEW_KEYS = 16 };

static uint64_t mix(uint64_t key)
{
    key = (key ^ key >> 32) * UINT64_C(0xd6e8feb86659fd93);
    key = (key ^ key >> 32) * UINT64_C(0xd6e8feb86659fd93);
    return key ^ key >> 32;
}

uint64_t trip_id_key(double value, bool *integer)
{
    const bool is = value >= -0x1p63 && value < 0x1p63 && value == floor(value);
    *integer = *integer && is;
    return is ? (uint64_t)(int64_t)value ^ UINT64_C(1) << 63 : 0;
}

/* Returns the entry of a key in the table, or the free entry for it. */
static trip_id_entry *entry_of(const trip_id_set *s, uint64_t key)
{
    uint32_t at = (uint32_t)mix(key) & (s->room - 1);
    while (s->entries[at].voxels && s->entries[at].key != key)
        at = (at + 1) & (s->room - 1);
    return &s->entries[at];
}

static void release(trip_id_set *s, trip_budget *budget)
{
    if (s->entries)
        trip_budget_release(budget, s->entries, s->room * sizeof *s->entries);
    s->entries = NULL;
    s->room = 0;
}

void trip_id_set_free(trip_id_set *s, trip_budget *budget)
{
    release(s, budget);
    *s = (trip_id_set){ 0 };
}

static void give_up(trip_id_set *s, trip_budget *budget)
{
    release(s, budget);
    s->count = 0;
    s->many = true;
}

/* Doubles the table. Returns false if memory is exhausted. */
static bool grow(trip_id_set *s, trip_budget *budget)
{
    trip_id_set larger = *s;
    larger.room = s->room ? 2 * s->room : FIRST_ROOM;
    larger.entries = trip_budget_take(budget, larger.room * sizeof *larger.entries);
    if (!larger.entries)
        return false;
    for (uint32_t i = 0; i < s->room; i++)
        if (s->entries[i].voxels)
            *entry_of(&larger, s->entries[i].key) = s->entries[i];
    release(s, budget);
    *s = larger;
    return true;
}

static void add_entry(trip_id_set *s, trip_id_entry e, trip_budget *budget)
{
    if (s->many || s->other || s->starved)
        return;
    if (2 * s->count >= s->room && !grow(s, budget)) {
        s->starved = true;
        return;
    }
    trip_id_entry *to = entry_of(s, e.key);
    s->count += to->voxels == 0;
    to->key = e.key;
    to->voxels += e.voxels;
    to->equal += e.equal;
    if (s->count > TRIP_IDS_MAX)
        give_up(s, budget);
}

void trip_id_set_add_row(trip_id_set *s, const uint64_t *keys, size_t count, uint64_t zero,
                         trip_budget *budget)
{
    for (size_t i = 0, past; i < count; i = past) {
        for (past = i + 1; past < count && keys[past] == keys[i];)
            past++;
        const trip_id_entry run = { keys[i], past - i, past - i - 1 };
        add_entry(s, run, budget);
        s->voxels += run.key == zero ? 0 : run.voxels;
        s->equal += run.key == zero ? 0 : run.equal;
    }
}

void trip_id_set_add(trip_id_set *s, const trip_id_set *other, trip_budget *budget)
{
    s->voxels += other->voxels;
    s->equal += other->equal;
    s->other |= other->other;
    s->starved |= other->starved;
    if (other->many)
        give_up(s, budget);
    for (uint32_t i = 0; i < other->room; i++)
        if (other->entries[i].voxels)
            add_entry(s, other->entries[i], budget);
}

bool trip_id_set_coherent(const trip_id_set *s)
{
    uint32_t labels = 0;
    if (s->many)
        return (double)s->equal >= equal_part * (double)s->voxels;
    for (uint32_t i = 0; i < s->room; i++) {
        const trip_id_entry *e = &s->entries[i];
        labels += e->voxels && (double)e->equal >= equal_part * (double)e->voxels;
    }
    return s->count <= FEW_KEYS || labels >= label_part * s->count;
}

static int compare(const void *a, const void *b)
{
    const uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return (x > y) - (x < y);
}

static bool is_signed(trip_scalar type)
{
    return type == TRIP_I32 || type == TRIP_I64 || type >= TRIP_F16;
}

static double value_of(uint64_t key, const trip_volume_info *info)
{
    const double stored =
        is_signed(info->type) ? (double)(int64_t)(key ^ UINT64_C(1) << 63) : (double)key;
    return info->type >= TRIP_F16 ? stored : info->slope * stored + info->inter;
}

/* Ids beyond 2^53 may round to one double. Each then gets the next double, so that values ascend.
 */
static void fill_values(trip_ids *ids, const trip_volume_info *info)
{
    ids->descending = info->type < TRIP_F16 && info->slope < 0;
    for (uint32_t i = 0; i < ids->count; i++) {
        const uint32_t from = ids->descending ? ids->count - 1 - i : i;
        const double value = value_of(ids->keys[from], info);
        ids->values[i] = i > 0 && !(value > ids->values[i - 1])
                             ? nextafter(ids->values[i - 1], INFINITY)
                             : value;
    }
}

int trip_ids_make(trip_ids *out, const trip_id_set *s, const trip_volume_info *info,
                  const char *path, trip_budget *budget)
{
    trip_ids ids = { .numbered = s->many,
                     .count = s->many ? TRIP_IDS_NUMBERS : s->count,
                     .zero = is_signed(info->type) ? UINT64_C(1) << 63 : 0 };
    uint32_t n = 0;
    ids.values = trip_budget_take(budget, ids.count * sizeof *ids.values);
    ids.keys = s->many ? NULL : trip_budget_take(budget, ids.count * sizeof *ids.keys);
    if (!ids.values || (!s->many && !ids.keys)) {
        trip_ids_free(&ids, budget);
        return trip_fail(TRIP_ERROR, "brick", path,
                         "the table of its ids needs more memory than --memory allows: raise "
                         "--memory");
    }
    for (uint32_t i = 0; i < s->room && !s->many; i++)
        if (s->entries[i].voxels)
            ids.keys[n++] = s->entries[i].key;
    if (ids.keys) {
        qsort(ids.keys, ids.count, sizeof *ids.keys, compare);
        fill_values(&ids, info);
    }
    for (uint32_t i = 0; i < ids.count && s->many; i++)
        ids.values[i] = i;
    *out = ids;
    return 0;
}

void trip_ids_free(trip_ids *ids, trip_budget *budget)
{
    if (ids->keys)
        trip_budget_release(budget, ids->keys, ids->count * sizeof *ids->keys);
    if (ids->values)
        trip_budget_release(budget, ids->values, ids->count * sizeof *ids->values);
    *ids = (trip_ids){ 0 };
}

static float rank_of(const trip_ids *ids, uint64_t key)
{
    if (ids->numbered)
        return key == ids->zero ? 0 : (float)(1 + mix(key) % (TRIP_IDS_NUMBERS - 1));
    uint32_t first = 0, past = ids->count;
    while (past - first > 1) {
        const uint32_t middle = first + (past - first) / 2;
        if (ids->keys[middle] <= key)
            first = middle;
        else
            past = middle;
    }
    if (ids->keys[first] != key)
        return NAN;
    return (float)(ids->descending ? ids->count - 1 - first : first);
}

void trip_ids_ranks(const trip_ids *ids, const uint64_t *keys, size_t count, float *ranks)
{
    for (size_t i = 0; i < count; i++)
        ranks[i] = i > 0 && keys[i] == keys[i - 1] ? ranks[i - 1] : rank_of(ids, keys[i]);
}
