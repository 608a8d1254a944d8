/* The resource file of an FMU: named arrays, written by resource.py, read here with suspicion. */
#ifndef RAILCOSIM_RESOURCE_H
#define RAILCOSIM_RESOURCE_H

#include <stddef.h>
#include <stdint.h>

#define RESOURCE_NAME_SIZE 24
#define RESOURCE_MAX_DIMS 3
#define RESOURCE_MAX_SIZE ((uint64_t)1 << 31)

typedef enum { TYPE_DOUBLE = 1, TYPE_INT32 = 2, TYPE_BYTE = 3, TYPE_FLOAT = 4 } ElementType;

/* The whole file in memory; sections are looked up in it by name. */
typedef struct {
    unsigned char *bytes;
    size_t size;
    uint32_t sections;
} Resource;

/* All return 1, or 0 with a sentence in `why` (of size `room`). */
int resource_load(Resource *resource, const char *path, char *why, size_t room);
int resource_check(const Resource *resource, char *why, size_t room);

/* Data of a section that must have this type and shape (`dims` ends with the first 0 given up to
   RESOURCE_MAX_DIMS); NULL, with a sentence in `why`, if there is no such section. */
const void *resource_find(const Resource *resource, const char *name, ElementType type,
                          const size_t dims[RESOURCE_MAX_DIMS], char *why, size_t room);
/* Number of elements along the first dimension; 0 if there is no such section. */
size_t resource_length(const Resource *resource, const char *name);
/* Likewise along the second. */
size_t resource_second(const Resource *resource, const char *name);
void resource_free(Resource *resource);
/* CRC-32 as in zlib and PNG: finds damage, not malice. */
uint32_t crc32_of(const unsigned char *bytes, size_t size);

#endif
