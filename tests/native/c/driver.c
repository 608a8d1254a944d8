/* Drives the binary of an FMU: one command a line on standard input, one reply on standard output.

       driver LIBRARY

   A command is words: its name, an instance (a number; '-' for a null pointer), arguments. A reply
   is the log messages that the FMU sent, one a line after "log ", and a line "= STATUS value ...".
   Numbers are printed in full. FMI (2 or 3) is defined when it is compiled, for Linux or Windows.
   Every array handed to the FMU is a block of memory of just its size: a sanitizer sees a step
   beyond it. */
#include "driver.h"

#if FMI == 2
#include "calls_fmi2.h"
#else
#include "calls_fmi3.h"
#endif

#ifdef _WIN32
#include <windows.h>
static HMODULE library;
static void open_library(const char *path) { library = LoadLibraryA(path); }
static void *find(const char *name) { return (void *)(uintptr_t)GetProcAddress(library, name); }
#else
#include <dlfcn.h>
static void *library;
static void open_library(const char *path) { library = dlopen(path, RTLD_NOW | RTLD_LOCAL); }
static void *find(const char *name) { return dlsym(library, name); }
#endif

enum { PLACES = 64, WORDS = 1 << 16 };

static Instance instances[PLACES];
static State states[PLACES];
static unsigned char *serialized[PLACES];
static size_t serialized_size[PLACES];
static char *words[WORDS];
static size_t n_words, next_word;

static void give_up(const char *why, const char *what)
{
    fprintf(stderr, "driver: %s %s\n", why, what);
    exit(3);
}

static void *symbol(const char *name)
{
    void *address = find(name);
    if (address == NULL)
        give_up("the library has no", name);
    return address;
}

/* --- memory that can run out: the library is linked with --wrap -------------------------------- */

static long requests, last_good = -1; /* -1: all are */

static int refused(void) { return last_good >= 0 && requests++ >= last_good; }

void *__wrap_malloc(size_t size);
void *__wrap_calloc(size_t n, size_t size);
void *__wrap_realloc(void *old, size_t size);
void *__wrap_malloc(size_t size) { return refused() ? NULL : malloc(size); }
void *__wrap_calloc(size_t n, size_t size) { return refused() ? NULL : calloc(n, size); }
void *__wrap_realloc(void *old, size_t size) { return refused() ? NULL : realloc(old, size); }

/* --- arguments --------------------------------------------------------------------------------- */

static char *word(void)
{
    if (next_word >= n_words)
        give_up("too few words after", words[0]);
    return words[next_word++];
}

static double number(void) { return strtod(word(), NULL); }
static size_t integer(void) { return strtoul(word(), NULL, 0); }
static size_t place(void) { return integer() % PLACES; }
static size_t rest(void) { return n_words - next_word; }

static Instance instance(void)
{
    const char *name = word();
    return strcmp(name, "-") == 0 ? NULL : instances[strtoul(name, NULL, 10) % PLACES];
}

static void *block(size_t n, size_t size)
{
    void *memory = malloc(n * size); /* n = 0 as well: nothing may be read or written there */
    if (memory == NULL)
        give_up("no memory", "");
    return memory;
}

static double *numbers(size_t n)
{
    double *x = block(n, sizeof *x);
    for (size_t k = 0; k < n; k++)
        x[k] = number();
    return x;
}

/* Given as places in the table, which FMI 3 counts from 1 here. */
static Ref *references(size_t n)
{
    Ref *refs = block(n, sizeof *refs);
    for (size_t k = 0; k < n; k++) {
        refs[k] = (Ref)integer();
        if (FMI == 3 && refs[k] < 1 << 16)
            refs[k]++;
    }
    return refs;
}

static Integer *integers(size_t n)
{
    Integer *i = block(n, sizeof *i);
    for (size_t k = 0; k < n; k++)
        i[k] = (Integer)strtol(word(), NULL, 10);
    return i;
}

/* --- replies ----------------------------------------------------------------------------------- */

static void reply(int status) { printf("= %s\n", STATUS[status]); }

/* Values only where there are some. */
static void reply_numbers(int status, double *x, size_t n)
{
    printf("= %s", STATUS[status]);
    for (size_t k = 0; status <= 1 && k < n; k++)
        printf(" %.17g", x[k]);
    printf("\n");
    free(x);
}

/* --- commands ---------------------------------------------------------------------------------- */

static void do_new(void) /* PLACE cs|me GUID RESOURCES LOGGING */
{
    const size_t k = place();
    const int exchange = strcmp(word(), "me") == 0;
    const char *guid = word(), *resources = word();
    instances[k] = create(exchange, strcmp(guid, "-") == 0 ? NULL : guid,
                          strcmp(resources, "-") == 0 ? NULL : resources, (int)integer());
    printf("= %s\n", instances[k] == NULL ? "NULL" : "OK");
}

static void do_free(void)
{
    const size_t k = place();
    destroy(instances[k]);
    instances[k] = NULL;
    reply(0);
}

static void do_enter(void) /* I START [STOP] */
{
    Instance c = instance();
    const double start = number();
    const int stop = rest() > 0;
    reply(enter(c, start, stop, stop ? number() : 0.0));
}

static void do_exit(void) { reply(leave(instance())); }
static void do_terminate(void) { reply(terminate(instance())); }
static void do_reset(void) { reply(reset(instance())); }

static void do_debug(void) /* I ON CATEGORY... */
{
    Instance c = instance();
    const int on = (int)integer();
    const size_t n = rest();
    const char **categories = block(n, sizeof *categories);
    for (size_t k = 0; k < n; k++)
        categories[k] = word();
    reply(debug(c, on, n, categories));
    free(categories);
}

static void do_set(void) /* I N ref... value... */
{
    Instance c = instance();
    const size_t n = integer();
    Ref *refs = references(n);
    const size_t m = rest();
    double *values = numbers(m);
    reply(set_reals(c, refs, n, values, m));
    free(refs);
    free(values);
}

static void do_get(void) /* I M ref...: M values */
{
    Instance c = instance();
    const size_t m = integer(), n = rest();
    Ref *refs = references(n);
    double *values = block(m, sizeof *values);
    reply_numbers(get_reals(c, refs, n, values, m), values, m);
    free(refs);
}

static void do_set_integer(void) /* I ref value */
{
    Instance c = instance();
    Ref *refs = references(1);
    Integer *values = integers(1);
    reply(set_integers(c, refs, 1, values));
    free(refs);
    free(values);
}

static void do_get_integer(void) /* I ref */
{
    Instance c = instance();
    Ref *refs = references(1);
    Integer value = 0;
    const int status = get_integers(c, refs, 1, &value);
    printf("= %s %ld\n", STATUS[status], (long)value);
    free(refs);
}

static void do_set_boolean(void) /* I ref value */
{
    Instance c = instance();
    Ref *refs = references(1);
    Boolean value = integer() != 0;
    reply(set_booleans(c, refs, 1, &value));
    free(refs);
}

static void do_get_boolean(void) /* I ref */
{
    Instance c = instance();
    Ref *refs = references(1);
    Boolean value = 0;
    const int status = get_booleans(c, refs, 1, &value);
    printf("= %s %d\n", STATUS[status], (int)value);
    free(refs);
}

static void do_strings(void) /* I ref: set, then get, neither of which there is */
{
    Instance c = instance();
    Ref *refs = references(1);
    const char *text = "text";
    const int status = set_strings(c, refs, 1, &text);
    reply(status > 1 ? get_strings(c, refs, 1, &text) : status);
    free(refs);
}

static void do_null(void) /* I N: null pointers for references and values */
{
    Instance c = instance();
    const size_t n = integer();
    const int status = set_reals(c, NULL, n, NULL, n);
    const int other = get_reals(c, NULL, n, NULL, n);
    reply(status > other ? status : other);
}

static void do_step(void) /* I t h */
{
    Instance c = instance();
    const double t = number(), h = number();
    reply(step(c, t, h));
}

#if FMI == 2
static void do_input_derivatives(void) /* I order ref value */
{
    Instance c = instance();
    Integer *orders = integers(1);
    Ref *refs = references(1);
    double *values = numbers(1);
    reply(input_derivatives(c, refs, 1, orders, values));
    free(orders);
    free(refs);
    free(values);
}
#endif

static void do_output_derivatives(void) /* I order ref */
{
    Instance c = instance();
    Integer *orders = integers(1);
    Ref *refs = references(1);
    double *values = block(1, sizeof *values);
    reply_numbers(output_derivatives(c, refs, 1, orders, values), values, 1);
    free(orders);
    free(refs);
}

static void do_save(void) /* I PLACE: into a state that may be there already */
{
    Instance c = instance();
    reply(save(c, &states[place()]));
}

static void do_restore(void) /* I PLACE */
{
    Instance c = instance();
    reply(restore(c, states[place()]));
}

static void do_free_state(void) /* I PLACE */
{
    Instance c = instance();
    State *state = &states[place()];
    const int status = free_state(c, state);
    printf("= %s %s\n", STATUS[status], *state == NULL ? "null" : "left");
}

static void do_serialize(void) /* I PLACE MORE: into a block of the right size and MORE */
{
    Instance c = instance();
    const size_t k = place();
    const long more = strtol(word(), NULL, 10);
    size_t size = 0;
    int status = state_size(c, states[k], &size);
    if (status <= 1) {
        serialized_size[k] = (size_t)((long)size + more);
        free(serialized[k]);
        serialized[k] = block(serialized_size[k], 1);
        memset(serialized[k], 0, serialized_size[k]);
        status = serialize(c, states[k], serialized[k], serialized_size[k]);
    }
    printf("= %s %lu\n", STATUS[status], (unsigned long)size);
}

static void do_deserialize(void) /* I PLACE MORE: a block of another size if MORE is not 0 */
{
    Instance c = instance();
    const size_t k = place(), old = serialized_size[k];
    const size_t size = (size_t)((long)old + strtol(word(), NULL, 10));
    unsigned char *bytes = block(size, 1);
    memset(bytes, 0, size);
    if (old > 0)
        memcpy(bytes, serialized[k], size < old ? size : old);
    reply(deserialize(c, bytes, size, &states[k]));
    free(bytes);
}

static void do_damage(void) /* PLACE BYTE MASK: of a serialised state */
{
    const size_t k = place(), at = integer();
    const unsigned mask = (unsigned)integer();
    if (at < serialized_size[k])
        serialized[k][at] = (unsigned char)(serialized[k][at] ^ mask);
    reply(0);
}

static void do_directional(void) /* I N unknown... M known... NS seed... NR */
{
    Instance c = instance();
    const size_t n = integer();
    Ref *unknowns = references(n);
    const size_t m = integer();
    Ref *knowns = references(m);
    const size_t n_seed = integer();
    double *seed = numbers(n_seed);
    const size_t n_result = integer();
    double *result = block(n_result, sizeof *result);
    const int status = directional(c, unknowns, n, knowns, m, seed, n_seed, result, n_result);
    reply_numbers(status, result, n_result);
    free(unknowns);
    free(knowns);
    free(seed);
}

static void do_time(void)
{
    Instance c = instance();
    reply(set_time(c, number()));
}

static void do_event(void) { reply(event_mode(instance())); }
static void do_discrete(void) { reply(discrete(instance())); }
static void do_continuous(void) { reply(continuous_mode(instance())); }
static void do_completed(void) { reply(completed(instance())); }

static void do_set_states(void) /* I value... */
{
    Instance c = instance();
    const size_t n = rest();
    double *x = numbers(n);
    reply(set_states(c, x, n));
    free(x);
}

static void vector(int (*function)(Instance, double *, size_t)) /* I N */
{
    Instance c = instance();
    const size_t n = integer();
    double *x = block(n, sizeof *x);
    reply_numbers(function(c, x, n), x, n);
}

static void do_get_states(void) { vector(get_states); }
static void do_rates(void) { vector(get_rates); }
static void do_nominals(void) { vector(nominals); }
static void do_indicators(void) { vector(indicators); }

static void do_memory(void) /* N: N more requests for memory are granted; -1: all. Says how many */
{
    printf("= OK %ld\n", requests);
    requests = 0;
    last_good = strtol(word(), NULL, 10);
}

static const struct {
    const char *name;
    void (*run)(void);
} COMMANDS[] = {
    {"new", do_new}, {"free", do_free}, {"enter", do_enter}, {"exit", do_exit},
    {"terminate", do_terminate}, {"reset", do_reset}, {"debug", do_debug}, {"set", do_set},
    {"get", do_get}, {"set_integer", do_set_integer}, {"get_integer", do_get_integer},
    {"set_boolean", do_set_boolean}, {"get_boolean", do_get_boolean}, {"strings", do_strings},
    {"null", do_null}, {"step", do_step}, {"output_derivatives", do_output_derivatives},
    {"save", do_save}, {"restore", do_restore}, {"free_state", do_free_state},
    {"serialize", do_serialize}, {"deserialize", do_deserialize}, {"damage", do_damage},
    {"directional", do_directional}, {"time", do_time}, {"event", do_event},
    {"discrete", do_discrete}, {"continuous", do_continuous}, {"completed", do_completed},
    {"set_states", do_set_states}, {"get_states", do_get_states}, {"rates", do_rates},
    {"nominals", do_nominals}, {"indicators", do_indicators}, {"memory", do_memory},
#if FMI == 2
    {"input_derivatives", do_input_derivatives},
#endif
};

static void obey(char *line)
{
    n_words = next_word = 0;
    for (char *w = strtok(line, " \r\n"); w != NULL && n_words < WORDS; w = strtok(NULL, " \r\n"))
        words[n_words++] = w;
    if (n_words == 0)
        return;
    const char *name = word();
    for (size_t k = 0; k < sizeof COMMANDS / sizeof *COMMANDS; k++)
        if (strcmp(COMMANDS[k].name, name) == 0) {
            COMMANDS[k].run();
            fflush(stdout);
            return;
        }
    give_up("there is no command", name);
}

int main(int argc, char **argv)
{
    static char line[1 << 20];
    if (argc == 2)
        open_library(argv[1]);
    if (library == NULL)
        give_up("cannot load the library", argc == 2 ? argv[1] : "(none given)");
    while (fgets(line, sizeof line, stdin) != NULL)
        obey(line);
    for (size_t k = 0; k < PLACES; k++) { /* what is lost after this is a leak */
        free(serialized[k]);
        if (instances[k] != NULL)
            destroy(instances[k]);
    }
    return 0;
}
