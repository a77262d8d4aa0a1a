#include "gl/sheet_textures.h"

#include "report.h"

/* Layers above the minimum may take only 1 / SHARE of the memory left. */
enum { SHARE = 4, CODE_BYTES = 4, GRADIENT_BYTES = 8, DEVIATION_BYTES = 2 };

void trip_gl_sheet_textures_release(trip_gl_sheet_textures *t)
{
    glDeleteTextures(1, &t->codes);
    glDeleteTextures(1, &t->gradients);
    glDeleteTextures(1, &t->deviations);
    trip_budget_discharge(t->budget, t->bytes);
    *t = (trip_gl_sheet_textures){ .budget = t->budget };
}

static int no_memory(const trip_gl_sheet_textures *t, int64_t width, int64_t height, unsigned min,
                     uint64_t bytes)
{
    uint64_t taken = trip_budget_limit_bytes(t->budget) - trip_budget_left_bytes(t->budget);
    return trip_fail(TRIP_ERROR, "gl", "sheets",
                     "%u sheets of %lld x %lld voxels do not fit the memory given; raise --memory "
                     "to more than %llu MiB, or use --renderer cpu or --classify pre",
                     min, (long long)width, (long long)height,
                     (unsigned long long)((taken + bytes) >> 20));
}

static int check_size(int64_t width, int64_t height)
{
    GLint max = 0;
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &max);
    if (width <= max && height <= max)
        return TRIP_OK;
    return trip_fail(TRIP_ERROR, "gl", "sheets",
                     "sheets of %lld x %lld voxels exceed this driver's texture limit of %d; use "
                     "another renderer, or --classify pre",
                     (long long)width, (long long)height, max);
}

static GLuint make_texture(const trip_gl_sheet_textures *t, GLenum format)
{
    GLuint texture;
    glCreateTextures(GL_TEXTURE_2D_ARRAY, 1, &texture);
    glTextureStorage3D(texture, 1, format, t->width, t->height, t->layers);
    glTextureParameteri(texture, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTextureParameteri(texture, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    glTextureParameteri(texture, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTextureParameteri(texture, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    return texture;
}

static int make(trip_gl_sheet_textures *t, int64_t width, int64_t height, unsigned min,
                bool gradients, bool deviations)
{
    uint64_t sheet = (uint64_t)width * (uint64_t)height;
    sheet *= CODE_BYTES + (gradients ? GRADIENT_BYTES : 0) + (deviations ? DEVIATION_BYTES : 0);
    uint64_t layers = trip_budget_left_bytes(t->budget) / SHARE / sheet;
    layers = layers < min ? min : layers;
    layers = layers > TRIP_GL_SHEETS_MAX ? TRIP_GL_SHEETS_MAX : layers;
    if (!trip_budget_charge(t->budget, layers * sheet))
        return no_memory(t, width, height, min, layers * sheet);
    t->bytes = layers * sheet;
    t->width = (int)width;
    t->height = (int)height;
    t->layers = (int)layers;
    t->codes = make_texture(t, GL_R32F);
    t->gradients = gradients ? make_texture(t, GL_RGBA16F) : 0;
    t->deviations = deviations ? make_texture(t, GL_R16) : 0;
    if (glGetError() == GL_NO_ERROR)
        return TRIP_OK;
    trip_gl_sheet_textures_release(t);
    return trip_fail(TRIP_ERROR, "gl", "sheets",
                     "the driver has no memory for sheets of %lld x %lld voxels", (long long)width,
                     (long long)height);
}

/* Adds deviations to textures without any. Returns false if the memory does not suffice. */
static bool add_deviations(trip_gl_sheet_textures *t)
{
    const uint64_t bytes =
        (uint64_t)t->width * (uint64_t)t->height * (uint64_t)t->layers * DEVIATION_BYTES;
    if (bytes > trip_budget_left_bytes(t->budget) / SHARE || !trip_budget_charge(t->budget, bytes))
        return false;
    t->bytes += bytes;
    t->deviations = make_texture(t, GL_R16);
    return glGetError() == GL_NO_ERROR;
}

/* Parts of a picture may have different levels of detail, of which only the coarse ones have
 * deviations. So textures with deviations also serve frames without them. */
int trip_gl_sheet_textures_fit(trip_gl_sheet_textures *t, int64_t width, int64_t height,
                               unsigned min, bool gradients, bool deviations)
{
    if (t->codes && width <= t->width && height <= t->height && t->layers >= (int)min &&
        gradients == (t->gradients != 0) && (t->deviations || !deviations || add_deviations(t)))
        return TRIP_OK;
    trip_gl_sheet_textures_release(t);
    int status = check_size(width, height);
    return status ? status : make(t, width, height, min, gradients, deviations);
}

void trip_gl_sheet_textures_clear(const trip_gl_sheet_textures *t, int layer, int width, int height,
                                  float missing)
{
    const GLfloat none = missing;
    glClearTexSubImage(t->codes, 0, 0, 0, layer, width, height, 1, GL_RED, GL_FLOAT, &none);
}
