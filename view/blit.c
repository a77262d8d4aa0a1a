#include "blit.h"

#include <epoxy/gl.h>
#include <stdlib.h>
#include <string.h>

#include "report.h"
#include "view_shader_text.h"

struct trip_blit {
    GLuint program, texture, vertices;
    GLint corners;
    int width, height; /* of the texture */
};

static const char *text_of(const char *name)
{
    const trip_view_shader_text *s = trip_view_shader_texts;
    while (s->name && strcmp(s->name, name))
        s++;
    return s->text;
}

static int add_shader(GLuint program, GLenum kind, const char *name)
{
    char log[512] = "";
    GLint good = 0;
    GLuint shader = glCreateShader(kind);
    const char *text = text_of(name);
    glShaderSource(shader, 1, &text, NULL);
    glCompileShader(shader);
    glGetShaderiv(shader, GL_COMPILE_STATUS, &good);
    if (good)
        glAttachShader(program, shader);
    else
        glGetShaderInfoLog(shader, sizeof log, NULL, log);
    glDeleteShader(shader);
    return good ? 0 : trip_fail(TRIP_ERROR, "view", name, "%s", log);
}

static int make_program(trip_blit *b)
{
    GLint good = 0;
    b->program = glCreateProgram();
    int status = add_shader(b->program, GL_VERTEX_SHADER, "picture.vert");
    if (!status)
        status = add_shader(b->program, GL_FRAGMENT_SHADER, "picture.frag");
    if (status)
        return status;
    glLinkProgram(b->program);
    glGetProgramiv(b->program, GL_LINK_STATUS, &good);
    b->corners = glGetUniformLocation(b->program, "corners");
    return good ? 0 : trip_fail(TRIP_ERROR, "view", "picture.vert", "the shaders do not link");
}

int trip_blit_create(trip_blit **out)
{
    trip_blit *b = *out = calloc(1, sizeof *b);
    if (!b)
        return trip_fail(TRIP_ERROR, "view", "window", "out of memory");
    int status = make_program(b);
    glGenTextures(1, &b->texture);
    glGenVertexArrays(1, &b->vertices);
    glBindTexture(GL_TEXTURE_2D, b->texture);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    if (status) {
        trip_blit_destroy(b);
        *out = NULL;
    }
    return status;
}

void trip_blit_destroy(trip_blit *b)
{
    if (!b)
        return;
    glDeleteProgram(b->program);
    glDeleteTextures(1, &b->texture);
    glDeleteVertexArrays(1, &b->vertices);
    free(b);
}

void trip_blit_upload(trip_blit *b, const uint8_t *rgba, int width, int height)
{
    glBindTexture(GL_TEXTURE_2D, b->texture);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    if (b->width == width && b->height == height)
        glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, width, height, GL_RGBA, GL_UNSIGNED_BYTE, rgba);
    else
        glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, width, height, 0, GL_RGBA, GL_UNSIGNED_BYTE, rgba);
    b->width = width;
    b->height = height;
}

void trip_blit_draw(const trip_blit *b, const float corners[4][4], bool exact)
{
    const GLint filter = exact ? GL_NEAREST : GL_LINEAR;
    if (!b->width)
        return;
    glDisable(GL_BLEND);
    glDisable(GL_SCISSOR_TEST);
    glUseProgram(b->program);
    glBindVertexArray(b->vertices);
    glActiveTexture(GL_TEXTURE0);
    glBindTexture(GL_TEXTURE_2D, b->texture);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, filter);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, filter);
    glUniform4fv(b->corners, 4, corners[0]);
    glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
    glBindVertexArray(0);
    glUseProgram(0);
}

void trip_blit_read(int width, int height, float *rgba)
{
    const size_t row = (size_t)width * 4;
    glPixelStorei(GL_PACK_ALIGNMENT, 1);
    for (int y = 0; y < height; y++) {
        float *to = rgba + (size_t)y * row;
        glReadPixels(0, height - 1 - y, width, 1, GL_RGBA, GL_FLOAT, to);
        for (int x = 0; x < width; x++)
            to[4 * x + 3] = 1;
    }
}

void trip_blit_clear(int width, int height, float r, float g, float b)
{
    glViewport(0, 0, width, height);
    glDisable(GL_SCISSOR_TEST);
    glClearColor(r, g, b, 1);
    glClear(GL_COLOR_BUFFER_BIT);
}
