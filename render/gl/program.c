#include "gl/program.h"

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "gl/gl_shader_text.h"
#include "report.h"

/* Some compilers drop the file number of #line. So the line number encodes the file as well. */
enum { MAX_FILES = 16, MAX_SHADER_BYTES = 1 << 20, MAX_NAME = 64, LINES_PER_FILE = 10000 };

/* The text of one stage with its includes, and the names of the source files. */
typedef struct stage_text {
    FILE *out;
    char *bytes;
    size_t size;
    char names[MAX_FILES][MAX_NAME];
    int files;
} stage_text;

static char *embedded(const char *name)
{
    for (const trip_gl_shader_text *t = trip_gl_shader_texts; t->name; t++)
        if (strcmp(t->name, name) == 0)
            return strdup(t->text);
    return NULL;
}

static char *from_disk(const char *folder, const char *name)
{
    char path[4096];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "rb");
    char *text = file ? calloc(1, MAX_SHADER_BYTES + 1) : NULL;
    size_t bytes = text ? fread(text, 1, MAX_SHADER_BYTES + 1, file) : 0;
    bool whole = text && !ferror(file) && bytes <= MAX_SHADER_BYTES;
    if (file)
        fclose(file);
    if (whole)
        return text;
    free(text);
    return NULL;
}

/* The shared header always comes from the binary, because the C code was compiled with it. */
static char *load(const char *name)
{
    const char *folder = getenv("TRIPTYCH_SHADER_DIR");
    bool shared = strcmp(name, "shared.h") == 0;
    char *text = folder && *folder && !shared ? from_disk(folder, name) : embedded(name);
    if (!text)
        trip_fail(TRIP_ERROR, "gl", name, "cannot read the shader from %s",
                  folder && *folder && !shared ? folder : "the binary");
    return text;
}

static bool seen(const stage_text *t, const char *name)
{
    for (int i = 0; i < t->files; i++)
        if (strcmp(t->names[i], name) == 0)
            return true;
    return false;
}

/* Extracts the name from a line `#include "name"`, or sets an empty string. */
static void include_name(const char *line, char name[MAX_NAME])
{
    name[0] = 0;
    if (strncmp(line, "#include \"", 10) != 0)
        return;
    size_t length = strcspn(line + 10, "\"\n");
    if (length < MAX_NAME && line[10 + length] == '"') {
        memcpy(name, line + 10, length);
        name[length] = 0;
    }
}

/* Appends a file with its includes, unless the text already contains it. */
static int append_file(stage_text *t, const char *name)
{
    if (seen(t, name))
        return TRIP_OK;
    if (t->files == MAX_FILES || strlen(name) >= MAX_NAME)
        return trip_fail(TRIP_ERROR, "gl", name, "more than %d shader files included", MAX_FILES);
    char *text = load(name);
    if (!text)
        return TRIP_ERROR;
    int number = t->files++, status = TRIP_OK;
    strcpy(t->names[number], name);
    fprintf(t->out, "#line %d\n", number * LINES_PER_FILE + 1);
    int line_number = 1;
    for (char *line = text, *end; *line && !status; line = end, line_number++) {
        char included[MAX_NAME];
        end = line + strcspn(line, "\n");
        end += *end == '\n';
        include_name(line, included);
        if (!included[0]) {
            fwrite(line, 1, (size_t)(end - line), t->out);
            continue;
        }
        status = append_file(t, included);
        fprintf(t->out, "#line %d\n", number * LINES_PER_FILE + line_number + 1);
    }
    free(text);
    return status;
}

static int make_text(stage_text *t, const char *name, const char *defines)
{
    *t = (stage_text){ 0 };
    t->out = open_memstream(&t->bytes, &t->size);
    if (!t->out)
        return trip_fail(TRIP_ERROR, "gl", name, "out of memory");
    fprintf(t->out, "#version 450 core\n#define TRIP_GLSL 1\n%s", defines);
    int status = append_file(t, name);
    if (fclose(t->out) != 0 && !status)
        status = trip_fail(TRIP_ERROR, "gl", name, "out of memory");
    return status;
}

/* Returns the number after the first "0:" or "0(" of a line, or -1. The formats are "0:12(3):
 * error: ..." (Mesa), "0(12) : error ..." (NVIDIA) and "ERROR: 0:12: ..." (others). */
static long line_number_in(const char *line)
{
    for (const char *at = strchr(line, '0'); at; at = strchr(at + 1, '0'))
        if ((at[1] == ':' || at[1] == '(') && at[2] >= '0' && at[2] <= '9')
            return strtol(at + 2, NULL, 10);
    return -1;
}

/* Returns the line of a log with the first error, or else the first line that is not empty, and
 * ends it there. NVIDIA's linker begins its logs with a title. */
static char *error_line(char *log)
{
    char *line = strstr(log, "error");
    if (!line)
        line = log + strspn(log, "\n");
    while (line > log && line[-1] != '\n')
        line--;
    line[strcspn(line, "\n")] = 0;
    return line;
}

/* Reports the first error of a compiler's log with the original file and line. */
static int fail_compile(const stage_text *t, const char *name, char *log)
{
    char *line = error_line(log), *error = strstr(line, "error");
    long number = line_number_in(line), file = number / LINES_PER_FILE;
    if (number < 0 || file >= t->files)
        return trip_fail(TRIP_ERROR, "gl", name, "the shader does not compile: %s", line);
    char where[MAX_NAME + 16];
    snprintf(where, sizeof where, "%s:%ld", t->names[file], number % LINES_PER_FILE);
    return trip_fail(TRIP_ERROR, "gl", where, "the shader does not compile: %s",
                     error ? error : line);
}

static int compile(GLuint program, GLenum kind, const char *name, const char *defines)
{
    stage_text text;
    GLint done = 0;
    int status = make_text(&text, name, defines);
    GLuint shader = status ? 0 : glCreateShader(kind);
    if (shader) {
        glShaderSource(shader, 1, (const GLchar *const *)&text.bytes, NULL);
        glCompileShader(shader);
        glGetShaderiv(shader, GL_COMPILE_STATUS, &done);
    }
    if (!status && !done) {
        char log[4096] = "";
        glGetShaderInfoLog(shader, sizeof log, NULL, log);
        status = fail_compile(&text, name, log);
    }
    if (!status)
        glAttachShader(program, shader);
    glDeleteShader(shader); /* GL keeps the shader while it is attached */
    free(text.bytes);
    return status;
}

static int link_program(GLuint program, const char *name)
{
    GLint done = 0;
    glLinkProgram(program);
    glGetProgramiv(program, GL_LINK_STATUS, &done);
    if (done)
        return TRIP_OK;
    char log[4096] = "";
    glGetProgramInfoLog(program, sizeof log, NULL, log);
    return trip_fail(TRIP_ERROR, "gl", name, "the shaders do not link: %s", error_line(log));
}

int trip_gl_program_build(GLuint *out, const trip_gl_program_source *source)
{
    const char *names[] = { source->vertex, source->fragment, source->compute };
    static const GLenum kinds[] = { GL_VERTEX_SHADER, GL_FRAGMENT_SHADER, GL_COMPUTE_SHADER };
    const char *last = NULL;
    GLuint program = glCreateProgram();
    int status = program ? TRIP_OK : trip_fail(TRIP_ERROR, "gl", "program", "cannot be created");
    for (int i = 0; i < 3 && !status; i++) {
        if (!names[i])
            continue;
        last = names[i];
        status = compile(program, kinds[i], names[i], source->defines);
    }
    if (!status)
        status = link_program(program, last);
    if (status)
        glDeleteProgram(program);
    else
        *out = program;
    return status;
}
