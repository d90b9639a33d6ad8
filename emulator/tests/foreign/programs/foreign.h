/* What every program here shares: words out through semihosting, and random numbers that are the same everywhere. */
#pragma once
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Prints text. */
void put(const char *text);
/* Prints "name value\n", the value in hexadecimal. */
void say(const char *name, uint32_t value);
/* Ends the program: 0 is success. */
__attribute__((noreturn)) void leave(int code);
/* The next of a fixed sequence of pseudo-random words (xorshift). */
uint32_t random_word(void);
/* Starts that sequence again. */
void random_restart(void);
/* CRC-32 (reflected, polynomial 0xedb88320) of bytes, continued from `crc`. */
uint32_t crc32(uint32_t crc, const void *bytes, size_t length);

int main(void);

/* A register of the system control space. */
#define REG(address) (*(volatile uint32_t *)(address))

#ifdef __cplusplus
}
#endif
