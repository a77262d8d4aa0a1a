/* The memory limit: every large buffer is taken from a budget, which refuses what exceeds the limit
 * and records its peak. A run or a context has one budget, which all its threads use. */
#ifndef TRIP_BUDGET_H
#define TRIP_BUDGET_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct trip_budget trip_budget;

/* limit_bytes 0: trip_memory_available_bytes() / 4. */
int trip_budget_create(trip_budget **out, uint64_t limit_bytes);
void trip_budget_destroy(trip_budget *b);

uint64_t trip_budget_limit_bytes(const trip_budget *b);
uint64_t trip_budget_left_bytes(const trip_budget *b);
uint64_t trip_budget_peak_bytes(const trip_budget *b);

/* Zeroed memory, aligned to 4096 bytes, or NULL, with nothing reported, if it exceeds the budget or
 * the system refuses it. It is released with the same `bytes`. */
void *trip_budget_take(trip_budget *b, size_t bytes);
void trip_budget_release(trip_budget *b, void *memory, size_t bytes);

/* Counts bytes that are allocated elsewhere, such as by a GL driver; false if they exceed the
 * budget. */
bool trip_budget_charge(trip_budget *b, uint64_t bytes);
void trip_budget_discharge(trip_budget *b, uint64_t bytes);

/* The memory that this process may use: physical memory, or the limit of its control group (v1 or
 * v2) if that is smaller. */
uint64_t trip_memory_available_bytes(void);
/* Peak resident set of this process so far (VmHWM). */
uint64_t trip_memory_peak_rss_bytes(void);

/* Parses "256M", "1.5G", "4096": binary suffixes K M G T, optionally with "iB" or "B". False if it
 * is not a size. */
int trip_parse_bytes(const char *text, uint64_t *bytes_out);
/* "1.23 GB"-style text with decimal units into `text` (at least 32 bytes). */
const char *trip_format_bytes(uint64_t bytes, char *text);

#ifdef __cplusplus
}
#endif

#endif
