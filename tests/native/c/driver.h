/* What driver.c asks of an FMU, whichever version: calls_fmi2.h and calls_fmi3.h give it. Every
   function that returns an int returns the FMI status. */
#ifndef DRIVER_H
#define DRIVER_H

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef unsigned Ref;

/* The address of a function of the loaded library; ends the program if it has none. */
static void *symbol(const char *name);
/* Call NAME of the loaded library as the standard's headers declare it. */
#define CALL(NAME) ((NAME##TYPE *)symbol(#NAME))

static const char *const STATUS[] = {"OK", "Warning", "Discard", "Error", "Fatal", "Pending"};

/* A log message in full: messages may hold line ends, and a reply is lines. */
static void tell(int status, const char *category, const char *message)
{
    printf("log %s %s ", STATUS[status], category == NULL ? "-" : category);
    for (; *message != 0; message++)
        putchar(*message == '\n' ? ' ' : *message);
    putchar('\n');
}

#endif
