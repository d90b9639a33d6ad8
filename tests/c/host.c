/* Words from the file `input`, what is seen to the file `output`: on a computer. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <stdint.h>

static FILE *input, *output;

static void get(void *to, size_t n)
{
    if (n && fread(to, n, 1, input) != 1)
        exit(3);
}

static void put(const void *from, size_t n)
{
    if (n && fwrite(from, n, 1, output) != 1)
        exit(4);
}

static void play(void);

int main(void)
{
    input = fopen("input", "rb");
    output = fopen("output", "wb");
    if (!input || !output)
        return 2;
    play();
    return fclose(output) ? 5 : 0;
}
