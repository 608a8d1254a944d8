#include "resource_path.h"

#include <ctype.h>
#include <stdlib.h>
#include <string.h>

static const char FILE_NAME[] = "model.bin";

char *resource_path(const char *folder)
{
    if (folder == NULL)
        return NULL;
    const size_t n = strlen(folder);
    char *path = malloc(n + 1 + sizeof FILE_NAME);
    if (path == NULL)
        return NULL;
    memcpy(path, folder, n + 1);
    if (n > 0 && path[n - 1] != '/' && path[n - 1] != '\\')
        strcat(path, "/");
    strcat(path, FILE_NAME);
    return path;
}

static int hex(char digit)
{
    if (isdigit((unsigned char)digit))
        return digit - '0';
    return tolower((unsigned char)digit) - 'a' + 10;
}

/* Replace %20 and the like, in place. */
static void decode(char *text)
{
    char *to = text;
    for (const char *from = text; *from != 0; from++, to++) {
        const int coded = *from == '%' && isxdigit((unsigned char)from[1]) &&
                          isxdigit((unsigned char)from[2]);
        *to = coded ? (char)(16 * hex(from[1]) + hex(from[2])) : *from;
        from += coded ? 2 : 0;
    }
    *to = 0;
}

char *resource_path_from_uri(const char *uri)
{
    if (uri == NULL || strncmp(uri, "file:", 5) != 0)
        return NULL;
    const char *path = uri + 5;
    if (strncmp(path, "//", 2) == 0) { /* file://[host]/path */
        const char *after = strchr(path + 2, '/');
        if (after == NULL)
            return NULL;
        if (after == path + 2 || strncmp(path, "//localhost/", 12) == 0)
            path = after; /* else a share of Windows: //server/share */
    }
    /* Windows: file:///C:/path */
    if (path[0] == '/' && isalpha((unsigned char)path[1]) && path[2] == ':')
        path++;
    char *folder = malloc(strlen(path) + 1);
    if (folder == NULL)
        return NULL;
    strcpy(folder, path);
    decode(folder);
    char *full = resource_path(folder);
    free(folder);
    return full;
}
