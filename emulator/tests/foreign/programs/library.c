/* Code of the C library as it is shipped: hand-written string routines, qsort with callbacks, formatted output with variable
   arguments, and jumps out of nested calls. */
#include "foreign.h"
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static char from[400], to[400];

/* Every alignment and many lengths: the routines have paths for each. */
static void strings(void)
{
    uint32_t crc = 0;
    for (size_t i = 0; i < sizeof from; i++)
        from[i] = (char)('a' + random_word() % 26);
    for (int a = 0; a < 4; a++)
        for (int b = 0; b < 4; b++)
            for (int length = 0; length < 90; length += 1 + length / 8) {
                memcpy(to + b, from + a, (size_t)length);
                memmove(to + b + 2, to + b, (size_t)length);
                memset(to + b + length + 9, length, 11);
                to[b + length + 1] = 0;
                crc = crc32(crc, to, 128);
                const int sign = strcmp(from + a, to + b);
                crc ^= (uint32_t)strlen(to + b) ^ (uint32_t)((sign > 0) - (sign < 0)) << 8;
                crc += (uint32_t)(strchr(from + a, 'q') != NULL) + (uint32_t)(memchr(from, 'z', 300) != NULL);
            }
    say("strings", crc);
}

static int compare(const void *a, const void *b)
{
    const uint16_t x = *(const uint16_t *)a, y = *(const uint16_t *)b;
    return (x > y) - (x < y);
}

static void sorting(void)
{
    static uint16_t values[150];
    for (size_t i = 0; i < 150; i++)
        values[i] = (uint16_t)random_word();
    qsort(values, 150, sizeof *values, compare);
    uint16_t key = values[77];
    const uint16_t *found = bsearch(&key, values, 150, sizeof *values, compare);
    say("sorted", crc32(0, values, sizeof values));
    say("found", found ? *found == key : 2);
}

static jmp_buf out;
static volatile int depth;

static __attribute__((noinline)) int climb(int level, int limit)
{
    depth = level;
    if (level == limit)
        longjmp(out, limit + 100);
    return level > 50 ? level : climb(level + 1, limit) + level;
}

static void jumps(void)
{
    volatile uint32_t crc = 0;
    for (volatile int limit = 1; limit < 12; limit++) {
        const int came_back = setjmp(out);
        if (came_back == 0)
            climb(0, limit);
        crc = crc32(crc, (const int *)&came_back, sizeof came_back) ^ (uint32_t)depth;
    }
    say("jumps", crc);
}

static long total(int count, ...)
{
    va_list list;
    long sum = 0;
    va_start(list, count);
    for (int i = 0; i < count; i++)
        sum += i & 1 ? (long)va_arg(list, long long) : va_arg(list, int);
    va_end(list);
    return sum;
}

int main(void)
{
    strings();
    sorting();
    jumps();
    say("variable", (uint32_t)total(6, 1, 20LL, 300, 4000LL, 50000, 600000LL));
    char text[160];
    snprintf(text, sizeof text, "%d|%5u|%-6s|%08lx|%c|%+d|%%|%.3s|%#x|%*d\n", -42, 7u, "abc", 0xdeadbeeful, 'z', 9,
             "truncated", 255, 6, 1234);
    put(text);
    say("parsed", (uint32_t)strtol("-0x7fe", NULL, 16) ^ (uint32_t)strtoul("3000000000", NULL, 10));
    return 0;
}

/* What newlib asks of a system; none of it is ever needed here. */
void *_sbrk(ptrdiff_t more)
{
    extern char end;
    static char *top = &end;
    char *before = top;
    top += more;
    return before;
}
int _close(int file) { return (void)file, -1; }
int _fstat(int file, void *status) { return (void)file, (void)status, -1; }
int _isatty(int file) { return (void)file, 0; }
int _lseek(int file, int offset, int whence) { return (void)file, (void)offset, (void)whence, -1; }
int _read(int file, char *bytes, int length) { return (void)file, (void)bytes, (void)length, -1; }
int _write(int file, char *bytes, int length) { return (void)file, (void)bytes, (void)length, -1; }
void _exit(int code) { leave(code); }
int _kill(int process, int signal) { return (void)process, (void)signal, -1; }
int _getpid(void) { return 1; }
