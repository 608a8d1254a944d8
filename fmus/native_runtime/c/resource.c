#include "resource.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* File: Head, Entry[sections], then the data of each entry, at multiples of ALIGNMENT.
   Little-endian, as every platform this is built for. */
#define ALIGNMENT 64
static const char MAGIC[8] = {'R', 'A', 'I', 'L', 'C', 'O', 'S', '1'};

typedef struct {
    char magic[8];
    uint64_t size;     /* of the file */
    uint64_t checksum; /* of everything after the head */
    uint32_t sections;
    uint32_t reserved;
} Head;

typedef struct {
    char name[RESOURCE_NAME_SIZE];
    uint32_t type;
    uint32_t ndim;
    uint64_t dims[RESOURCE_MAX_DIMS];
    uint64_t offset;
} Entry;

uint32_t crc32_of(const unsigned char *bytes, size_t size)
{
    uint32_t table[256], crc = 0xFFFFFFFFu;
    for (uint32_t k = 0; k < 256; k++) {
        uint32_t c = k;
        for (int bit = 0; bit < 8; bit++)
            c = c & 1 ? 0xEDB88320u ^ (c >> 1) : c >> 1;
        table[k] = c;
    }
    for (size_t k = 0; k < size; k++)
        crc = table[(crc ^ bytes[k]) & 0xFF] ^ (crc >> 8);
    return ~crc;
}

static size_t element_size(uint32_t type)
{
    switch (type) {
    case TYPE_DOUBLE: return 8;
    case TYPE_INT32: case TYPE_FLOAT: return 4;
    case TYPE_BYTE: return 1;
    default: return 0;
    }
}

static Entry entry_at(const Resource *resource, uint32_t k)
{
    Entry entry; /* copied: the file need not be aligned in memory */
    memcpy(&entry, resource->bytes + sizeof(Head) + k * sizeof(Entry), sizeof entry);
    return entry;
}

/* Number of elements, or SIZE_MAX if the entry makes no sense in a file of this size. */
static uint64_t elements(const Entry *entry, uint64_t file_size)
{
    uint64_t count = 1;
    if (entry->ndim < 1 || entry->ndim > RESOURCE_MAX_DIMS)
        return UINT64_MAX;
    for (uint32_t d = 0; d < entry->ndim; d++) {
        if (entry->dims[d] == 0 || entry->dims[d] > file_size / count)
            return UINT64_MAX;
        count *= entry->dims[d];
    }
    return count;
}

int resource_check(const Resource *resource, char *why, size_t room)
{
    Head head;
    if (resource->size < sizeof head) {
        snprintf(why, room, "is truncated: %lu bytes", (unsigned long)resource->size);
        return 0;
    }
    memcpy(&head, resource->bytes, sizeof head);
    if (memcmp(head.magic, MAGIC, sizeof MAGIC) != 0) {
        snprintf(why, room, "is not a model file of this runtime");
        return 0;
    }
    if (head.size != resource->size) {
        snprintf(why, room, "is truncated or has something added: %lu bytes, not %lu",
                 (unsigned long)resource->size, (unsigned long)head.size);
        return 0;
    }
#ifndef RAILCOSIM_FUZZING /* a fuzzer would never get past it */
    if (head.checksum != crc32_of(resource->bytes + sizeof head, resource->size - sizeof head)) {
        snprintf(why, room, "is damaged: its checksum is wrong");
        return 0;
    }
#endif
    if (head.sections != resource->sections ||
        head.sections > (resource->size - sizeof head) / sizeof(Entry)) {
        snprintf(why, room, "is damaged: %lu sections do not fit in it",
                 (unsigned long)head.sections);
        return 0;
    }
    for (uint32_t k = 0; k < head.sections; k++) {
        const Entry entry = entry_at(resource, k);
        const uint64_t count = elements(&entry, head.size), size = element_size(entry.type);
        if (size == 0 || count == UINT64_MAX || entry.offset % ALIGNMENT != 0 ||
            entry.offset > head.size || count > (head.size - entry.offset) / size ||
            memchr(entry.name, 0, sizeof entry.name) == NULL) {
            snprintf(why, room, "is damaged: section %lu", (unsigned long)k);
            return 0;
        }
    }
    return 1;
}

#ifdef _WIN32
#include <windows.h>

/* FMI gives paths as UTF-8; Windows' fopen would take them for the local code page. */
static FILE *open_file(const char *path)
{
    wchar_t wide[4096];
    const int size = (int)(sizeof wide / sizeof *wide);
    return MultiByteToWideChar(CP_UTF8, 0, path, -1, wide, size) > 0 ? _wfopen(wide, L"rb") : NULL;
}
#else
static FILE *open_file(const char *path)
{
    return fopen(path, "rb");
}
#endif

/* Size of the open file, or 0 with a sentence. */
static size_t file_size(FILE *file, char *why, size_t room)
{
    long size = -1;
    if (fseek(file, 0, SEEK_END) == 0)
        size = ftell(file);
    if (size <= 0 || (uint64_t)size > RESOURCE_MAX_SIZE || fseek(file, 0, SEEK_SET) != 0) {
        snprintf(why, room, "has no acceptable size");
        return 0;
    }
    return (size_t)size;
}

int resource_load(Resource *resource, const char *path, char *why, size_t room)
{
    memset(resource, 0, sizeof *resource);
    FILE *file = open_file(path);
    if (file == NULL) {
        snprintf(why, room, "cannot be opened");
        return 0;
    }
    const size_t size = file_size(file, why, room);
    if (size > 0) {
        resource->bytes = malloc(size);
        if (resource->bytes == NULL)
            snprintf(why, room, "needs %lu bytes of memory, which are not to be had",
                     (unsigned long)size);
        else if (fread(resource->bytes, 1, size, file) != size)
            snprintf(why, room, "cannot be read");
        else
            resource->size = size;
    }
    fclose(file);
    if (resource->size >= sizeof(Head))
        memcpy(&resource->sections, resource->bytes + offsetof(Head, sections), sizeof(uint32_t));
    if (resource->size > 0 && resource_check(resource, why, room))
        return 1;
    resource_free(resource);
    return 0;
}

static int find(const Resource *resource, const char *name, Entry *entry)
{
    for (uint32_t k = 0; k < resource->sections; k++) {
        *entry = entry_at(resource, k);
        if (strcmp(entry->name, name) == 0)
            return 1;
    }
    return 0;
}

const void *resource_find(const Resource *resource, const char *name, ElementType type,
                          const size_t dims[RESOURCE_MAX_DIMS], char *why, size_t room)
{
    Entry entry;
    int fits = find(resource, name, &entry) && entry.type == (uint32_t)type;
    for (uint32_t d = 0; fits && d < RESOURCE_MAX_DIMS; d++) {
        const uint64_t wanted = dims[d], found = d < entry.ndim ? entry.dims[d] : 0;
        fits = wanted == found;
    }
    if (fits)
        return resource->bytes + entry.offset;
    snprintf(why, room, "has no section '%s' of the right type and shape", name);
    return NULL;
}

size_t resource_length(const Resource *resource, const char *name)
{
    Entry entry;
    return find(resource, name, &entry) ? (size_t)entry.dims[0] : 0;
}

size_t resource_second(const Resource *resource, const char *name)
{
    Entry entry;
    return find(resource, name, &entry) ? (size_t)entry.dims[1] : 0;
}

void resource_free(Resource *resource)
{
    free(resource->bytes);
    memset(resource, 0, sizeof *resource);
}
