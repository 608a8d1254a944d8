/* Memory of an instance: all of it is taken here, by one rule.

   Mode shapes at 64 wheelsets take most of it, up to some 100 times what the file has of a mode where
   a cell has two nodes; the squares of so many contacts take 15 MB whatever the file's size. Who asks
   for more than the rule has made a file to do harm. */
#ifndef RAILCOSIM_MEMORY_RULE_H
#define RAILCOSIM_MEMORY_RULE_H

#include <stddef.h>
#include <stdlib.h>

enum { MEMORY_OF_ALL = 1 << 25, MEMORY_PER_BYTE = 128 };

typedef struct {
    size_t left; /* bytes */
} Memory;

/* What an instance of a resource file of this size (below 2^31) may take. */
static inline Memory memory_for(size_t file_size)
{
    const Memory memory = {MEMORY_OF_ALL + MEMORY_PER_BYTE * file_size};
    return memory;
}

/* `count` zeros of `size` bytes, to be freed; NULL: there are none, or the rule forbids it. */
static inline void *memory_take(Memory *memory, size_t count, size_t size)
{
    if (count > memory->left / size)
        return NULL;
    void *taken = calloc(count, size);
    if (taken != NULL)
        memory->left -= count * size;
    return taken;
}

#endif
