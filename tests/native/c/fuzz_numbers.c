/* How libFuzzer alters files: at random, as it always does, or numbers in sections, which stay numbers;
   else few files would be accepted. */
#include <math.h>
#include <stdint.h>
#include <string.h>

enum { HEAD = 32, SECTIONS_AT = 24 };
enum { DOUBLE = 1, INT32 = 2, BYTE = 3, FLOAT = 4 };

/* As in resource.c. */
typedef struct {
    char name[24];
    uint32_t type, ndim;
    uint64_t dims[3], offset;
} Entry;

size_t LLVMFuzzerMutate(unsigned char *bytes, size_t size, size_t most);
size_t LLVMFuzzerCustomMutator(unsigned char *bytes, size_t size, size_t most, unsigned seed);

static unsigned below(unsigned limit, unsigned *seed)
{
    *seed = *seed * 1664525u + 1013904223u; /* Numerical Recipes in C, 7.1 */
    return (*seed >> 8) % limit;
}

static double another(double value, double huge, unsigned *seed)
{
    const double others[] = {0,          1,          -value,       value * (1 + 1e-6),
                             value / 10, value * 10, value + 1e-3, value * (1 - 1e-3),
                             huge,       1 / huge,   -huge,        NAN};
    return others[below(sizeof others / sizeof *others, seed)];
}

static int32_t another_whole(int32_t value, unsigned *seed)
{
    const uint32_t v = (uint32_t)value;
    const uint32_t others[] = {0,     1,     2,  v + 1,    v - 1,    v / 2, 2 * v,
                               v ^ 1, v ^ 2, 64, 1u << 16, 1u << 20, ~0u};
    return (int32_t)others[below(sizeof others / sizeof *others, seed)];
}

#define ALTER(type, at, value)                                                                     \
    do {                                                                                           \
        type old, new;                                                                             \
        memcpy(&old, at, sizeof old);                                                              \
        new = (type)(value);                                                                       \
        memcpy(at, &new, sizeof new);                                                              \
    } while (0)

/* One number of one section; 0: there is none where this file says. */
static int alter_number(unsigned char *bytes, size_t size, unsigned *seed)
{
    static const size_t sizes[] = {0, sizeof(double), sizeof(int32_t), 1, sizeof(float)};
    uint32_t sections;
    Entry entry;
    if (size < HEAD + sizeof entry)
        return 0;
    memcpy(&sections, bytes + SECTIONS_AT, sizeof sections);
    if (sections == 0 || sections > (size - HEAD) / sizeof entry)
        return 0;
    memcpy(&entry, bytes + HEAD + below(sections, seed) * sizeof entry, sizeof entry);
    if (entry.type < DOUBLE || entry.type > FLOAT || entry.offset >= size)
        return 0;
    const uint64_t room = (size - entry.offset) / sizes[entry.type];
    uint64_t count = 1;
    for (int d = 0; d < 3 && entry.dims[d] > 0; d++)
        count *= entry.dims[d] < room ? entry.dims[d] : room;
    count = count < room ? count : room;
    if (count == 0)
        return 0;
    unsigned char *at = bytes + entry.offset + below((unsigned)count, seed) * sizes[entry.type];
    switch (entry.type) {
    case DOUBLE: ALTER(double, at, another(old, 1e300, seed)); break;
    case FLOAT: ALTER(float, at, another(old, 1e30, seed)); break;
    case INT32: ALTER(int32_t, at, another_whole(old, seed)); break;
    default: *at = (unsigned char)below(256, seed);
    }
    return 1;
}

size_t LLVMFuzzerCustomMutator(unsigned char *bytes, size_t size, size_t most, unsigned seed)
{
    int altered = 0;
    static const unsigned how_many[] = {0, 1, 1, 1, 1, 2, 2, 4};
    for (unsigned k = how_many[below(8, &seed)]; k > 0; k--)
        altered |= alter_number(bytes, size, &seed);
    return altered ? size : LLVMFuzzerMutate(bytes, size, most);
}
