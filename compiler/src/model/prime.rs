//! Primes.
