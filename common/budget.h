/* The memory limit. Every large buffer is taken from a budget, which refuses buffers beyond its
 * limit and records its peak. A run or a context has one budget, and all its threads use it. */
#ifndef TRIP_BUDGET_H
#define TRIP_BUDGET_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct trip_budget trip_budget;

/* Creates a budget. A limit of 0 means a quarter of trip_memory_available_bytes(). */
int trip_budget_create(trip_budget **out, uint64_t limit_bytes);
void trip_budget_destroy(trip_budget *b);

uint64_t trip_budget_limit_bytes(const trip_budget *b);
uint64_t trip_budget_left_bytes(const trip_budget *b);
uint64_t trip_budget_peak_bytes(const trip_budget *b);

/* Returns zeroed memory, aligned to 4096 bytes. Returns NULL, without a report, if the budget or
 * the system refuses it. Release it with the same `bytes`. */
void *trip_budget_take(trip_budget *b, size_t bytes);
void trip_budget_release(trip_budget *b, void *memory, size_t bytes);

/* Counts bytes allocated elsewhere, such as by a GL driver. Returns false if they exceed the
 * budget. */
bool trip_budget_charge(trip_budget *b, uint64_t bytes);
void trip_budget_discharge(trip_budget *b, uint64_t bytes);

/* Returns the memory that this process may use: physical memory, or the limit of its control group
 * (v1 or v2) if that is smaller. */
uint64_t trip_memory_available_bytes(void);
/* Returns the peak resident set of this process so far (VmHWM). */
uint64_t trip_memory_peak_rss_bytes(void);

/* Parses a size such as "256M", "1.5G" or "4096". The suffixes K, M, G and T are binary; "iB" or
 * "B" may follow. Returns false if the text is not a size. */
int trip_parse_bytes(const char *text, uint64_t *bytes_out);
/* Writes bytes in decimal units, such as "1.23 GB", into `text` (at least 32 bytes). Returns
 * `text`. */
const char *trip_format_bytes(uint64_t bytes, char *text);

#ifdef __cplusplus
}
#endif

#endif
