#include "exact_json.h"

#include <cjson/cJSON.h>

#include "text.h"

cJSON *trip_exact_number(double value)
{
    char text[32];
    return cJSON_CreateRaw(trip_text_from_double(value, text));
}

cJSON *trip_exact_numbers(const double *values, int count)
{
    cJSON *array = cJSON_CreateArray();
    for (int i = 0; array && i < count; i++)
        cJSON_AddItemToArray(array, trip_exact_number(values[i]));
    return array;
}

bool trip_exact_read(const cJSON *item, double lo, double hi, double *out)
{
    *out = cJSON_IsNumber(item) ? item->valuedouble : lo;
    return cJSON_IsNumber(item) && *out >= lo && *out <= hi;
}

bool trip_exact_read_numbers(const cJSON *item, int count, double lo, double hi, double *out)
{
    bool good = cJSON_IsArray(item) && cJSON_GetArraySize(item) == count;
    for (int i = 0; good && i < count; i++)
        good = trip_exact_read(cJSON_GetArrayItem(item, i), lo, hi, &out[i]);
    return good;
}
