#include "budget.h"

#include "memory_limits.h"
#include "report.h"
#include "text.h"

#include <assert.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#if defined(__SANITIZE_ADDRESS__)
#define TRIP_BUDGET_ON_HEAP 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define TRIP_BUDGET_ON_HEAP 1
#endif
#endif
#ifndef TRIP_BUDGET_ON_HEAP
#define TRIP_BUDGET_ON_HEAP 0
#endif

enum { ALIGNMENT_BYTES = 4096, SMALL_BYTES = 64 << 10, LARGE_BYTES = 2 << 20 };

struct trip_budget {
    uint64_t limit_bytes;
    _Atomic uint64_t used_bytes, peak_bytes; /* relaxed, since the counters order no other memory */
};

int trip_budget_create(trip_budget **out, uint64_t limit_bytes)
{
    trip_budget *b = calloc(1, sizeof *b);
    *out = b;
    if (!b)
        return trip_fail(TRIP_ERROR, "memory", "", "out of memory");
    b->limit_bytes = limit_bytes ? limit_bytes : trip_memory_available_bytes() / 4;
    return TRIP_OK;
}

void trip_budget_destroy(trip_budget *b)
{
    assert(!b || atomic_load(&b->used_bytes) == 0);
    free(b);
}

uint64_t trip_budget_limit_bytes(const trip_budget *b)
{
    return b->limit_bytes;
}

uint64_t trip_budget_left_bytes(const trip_budget *b)
{
    return b->limit_bytes - atomic_load_explicit(&b->used_bytes, memory_order_relaxed);
}

uint64_t trip_budget_peak_bytes(const trip_budget *b)
{
    return atomic_load_explicit(&b->peak_bytes, memory_order_relaxed);
}

/* Small memory, which every frame takes and releases, comes from the heap. Returning pages to the
 * system would interrupt all threads. Under AddressSanitizer all memory comes from the heap, so
 * that it checks bounds and leaks. */
static bool is_on_heap(size_t bytes)
{
    return TRIP_BUDGET_ON_HEAP || bytes <= SMALL_BYTES;
}

/* Larger memory is mapped from the system: already zero, and returned on release. Huge pages are
 * used where available, since direct reads into them need far fewer segments. */
static void *map_pages(size_t bytes)
{
    if (is_on_heap(bytes)) {
        void *memory = aligned_alloc(ALIGNMENT_BYTES, bytes);
        return memory ? memset(memory, 0, bytes) : NULL;
    }
    void *memory = mmap(NULL, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (memory == MAP_FAILED)
        return NULL;
    if (bytes >= LARGE_BYTES)
        madvise(memory, bytes, MADV_HUGEPAGE);
    return memory;
}

static void unmap_pages(void *memory, size_t bytes)
{
    if (is_on_heap(bytes))
        free(memory);
    else
        munmap(memory, bytes);
}

/* Rounds up to whole pages, at least one. Returns 0 on overflow. */
static size_t round_up(size_t bytes)
{
    size_t rounded;
    if (__builtin_add_overflow(bytes ? bytes : 1, (size_t)ALIGNMENT_BYTES - 1, &rounded))
        return 0;
    return rounded & ~((size_t)ALIGNMENT_BYTES - 1);
}

static bool reserve(trip_budget *b, uint64_t bytes)
{
    uint64_t used = atomic_load_explicit(&b->used_bytes, memory_order_relaxed);
    do {
        if (bytes > b->limit_bytes - used)
            return false;
    } while (!atomic_compare_exchange_weak_explicit(&b->used_bytes, &used, used + bytes,
                                                    memory_order_relaxed, memory_order_relaxed));
    uint64_t peak = atomic_load_explicit(&b->peak_bytes, memory_order_relaxed);
    while (peak < used + bytes &&
           !atomic_compare_exchange_weak_explicit(&b->peak_bytes, &peak, used + bytes,
                                                  memory_order_relaxed, memory_order_relaxed))
        ;
    return true;
}

void *trip_budget_take(trip_budget *b, size_t bytes)
{
    size_t rounded = round_up(bytes);
    if (rounded == 0 || !reserve(b, rounded))
        return NULL;
    void *memory = map_pages(rounded);
    if (!memory)
        atomic_fetch_sub_explicit(&b->used_bytes, rounded, memory_order_relaxed);
    return memory;
}

void trip_budget_release(trip_budget *b, void *memory, size_t bytes)
{
    if (!memory)
        return;
    unmap_pages(memory, round_up(bytes));
    atomic_fetch_sub_explicit(&b->used_bytes, round_up(bytes), memory_order_relaxed);
}

bool trip_budget_charge(trip_budget *b, uint64_t bytes)
{
    return reserve(b, bytes);
}

void trip_budget_discharge(trip_budget *b, uint64_t bytes)
{
    atomic_fetch_sub_explicit(&b->used_bytes, bytes, memory_order_relaxed);
}

uint64_t trip_memory_available_bytes(void)
{
    uint64_t physical = trip_proc_field_bytes("/proc/meminfo", "MemTotal");
    uint64_t group = trip_cgroup_limit_bytes("");
    if (physical == 0)
        physical = (uint64_t)sysconf(_SC_PHYS_PAGES) * (uint64_t)sysconf(_SC_PAGESIZE);
    return group < physical ? group : physical;
}

uint64_t trip_memory_peak_rss_bytes(void)
{
    return trip_proc_field_bytes("/proc/self/status", "VmHWM");
}

/* Returns the exponent of 2 for a suffix, or -1. */
static int suffix_shift(const char *suffix)
{
    static const char letters[] = "KMGT";
    if (*suffix == 0 || strcmp(suffix, "B") == 0)
        return 0;
    const char *letter = strchr(letters, *suffix & ~0x20);
    if (!letter || !*letter)
        return -1;
    if (suffix[1] && strcmp(suffix + 1, "B") != 0 && strcmp(suffix + 1, "iB") != 0)
        return -1;
    return 10 * (int)(letter - letters + 1);
}

int trip_parse_bytes(const char *text, uint64_t *bytes_out)
{
    char number[64];
    double value;
    size_t digits = strspn(text, "0123456789.");
    int shift = suffix_shift(text + digits);
    if (digits == 0 || digits >= sizeof number || shift < 0)
        return false;
    memcpy(number, text, digits);
    number[digits] = 0;
    if (!trip_text_to_double(number, &value))
        return false;
    value *= (double)((uint64_t)1 << shift);
    if (value >= 0x1p63)
        return false;
    *bytes_out = (uint64_t)value;
    return true;
}

const char *trip_format_bytes(uint64_t bytes, char *text)
{
    static const char *const units[] = { "kB", "MB", "GB", "TB", "PB", "EB" };
    if (bytes < 1000) {
        snprintf(text, 32, "%d bytes", (int)bytes);
        return text;
    }
    double value = (double)bytes / 1000;
    int unit = 0;
    while (value >= 999.5 && unit < 5) {
        value /= 1000;
        unit++;
    }
    int decimals = value < 9.995 ? 2 : value < 99.95 ? 1 : 0;
    snprintf(text, 32, "%.*f %s", decimals, value, units[unit]);
    return text;
}
