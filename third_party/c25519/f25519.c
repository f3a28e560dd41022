/* Arithmetic mod p = 2^255-19
 * Daniel Beer <dlbeer@gmail.com>, 5 Jan 2014
 *
 * This file is in the public domain.
 */

#include "f25519.h"

const uint8_t f25519_zero[F25519_SIZE] = {0};
const uint8_t f25519_one[F25519_SIZE] = {1};

void f25519_load(uint8_t *x, uint32_t c)
{
	unsigned int i;

	for (i = 0; i < sizeof(c); i++) {
		x[i] = c;
		c >>= 8;
	}

	for (; i < F25519_SIZE; i++)
		x[i] = 0;
}

void f25519_normalize(uint8_t *x)
{
	uint8_t minusp[F25519_SIZE];
	uint16_t c;
	int i;

	/* Reduce using 2^255 = 19 mod p */
	c = (x[31] >> 7) * 19;
	x[31] &= 127;

	for (i = 0; i < F25519_SIZE; i++) {
		c += x[i];
		x[i] = c;
		c >>= 8;
	}

	/* The number is now less than 2^255 + 18, and therefore less than
	 * 2p. Try subtracting p, and conditionally load the subtracted
	 * value if underflow did not occur.
	 */
	c = 19;

	for (i = 0; i + 1 < F25519_SIZE; i++) {
		c += x[i];
		minusp[i] = c;
		c >>= 8;
	}

	c += ((uint16_t)x[i]) - 128;
	minusp[31] = c;

	/* Load x-p if no underflow */
	f25519_select(x, minusp, x, (c >> 15) & 1);
}

uint8_t f25519_eq(const uint8_t *x, const uint8_t *y)
{
	uint8_t sum = 0;
	int i;

	for (i = 0; i < F25519_SIZE; i++)
		sum |= x[i] ^ y[i];

	sum |= (sum >> 4);
	sum |= (sum >> 2);
	sum |= (sum >> 1);

	return (sum ^ 1) & 1;
}

void f25519_select(uint8_t *dst,
		   const uint8_t *zero, const uint8_t *one,
		   uint8_t condition)
{
	const uint8_t mask = -condition;
	int i;

	for (i = 0; i < F25519_SIZE; i++)
		dst[i] = zero[i] ^ (mask & (one[i] ^ zero[i]));
}

/* Diastole, from here to f25519_sub, and f25519_mul__distinct: by words of 32
 * bits instead of bytes (see README.md). Results are below 2^255 + 2^12.
 */
static uint32_t f25519_word(const uint8_t *x)
{
	return x[0] | (uint32_t)x[1] << 8 | (uint32_t)x[2] << 16 |
	       (uint32_t)x[3] << 24;
}

/* r = x + high 2^256, reduced with 2^255 = 19 mod p */
static void f25519_fold(uint8_t *r, const uint32_t *x, uint32_t high)
{
	uint64_t c = (high * 2 + (x[7] >> 31)) * 19;
	int i;

	for (i = 0; i < 8; i++) {
		uint32_t word;

		c += i < 7 ? x[i] : x[i] & 0x7fffffff;
		word = (uint32_t)c;
		r[4 * i] = (uint8_t)word;
		r[4 * i + 1] = (uint8_t)(word >> 8);
		r[4 * i + 2] = (uint8_t)(word >> 16);
		r[4 * i + 3] = (uint8_t)(word >> 24);
		c >>= 32;
	}
}

void f25519_add(uint8_t *r, const uint8_t *a, const uint8_t *b)
{
	uint32_t sum[8];
	uint64_t c = 0;
	int i;

	for (i = 0; i < 8; i++) {
		c += (uint64_t)f25519_word(a + 4 * i) + f25519_word(b + 4 * i);
		sum[i] = (uint32_t)c;
		c >>= 32;
	}
	f25519_fold(r, sum, (uint32_t)c);
}

void f25519_sub(uint8_t *r, const uint8_t *a, const uint8_t *b)
{
	uint32_t difference[8];
	int64_t c = -37; /* a + 2p - b, 2p being 2^256 - 38 */
	int i;

	for (i = 0; i < 8; i++) {
		c += (int64_t)f25519_word(a + 4 * i) + 0xffffffff -
		     f25519_word(b + 4 * i);
		difference[i] = (uint32_t)c;
		c >>= 32;
	}
	f25519_fold(r, difference, (uint32_t)c);
}

void f25519_neg(uint8_t *r, const uint8_t *a)
{
	uint32_t c = 0;
	int i;

	/* Calculate 2p - a, to avoid underflow */
	c = 218;
	for (i = 0; i + 1 < F25519_SIZE; i++) {
		c += 65280 - ((uint32_t)a[i]);
		r[i] = c;
		c >>= 8;
	}

	c -= ((uint32_t)a[31]);
	r[31] = c & 127;
	c = (c >> 7) * 19;

	for (i = 0; i < F25519_SIZE; i++) {
		c += r[i];
		r[i] = c;
		c >>= 8;
	}
}

/* to[0 ... 8] = a y[0 ... 7] + to[0 ... 7] */
static inline void f25519_add_row(uint32_t *to, uint32_t a, const uint32_t *y)
{
#ifdef __ARM_FEATURE_DSP
	const uint32_t *const end = y + 8;
	uint32_t carry = 0;
	uint32_t low;
	uint32_t b;

	__asm__ volatile(
		"1: ldr %0, [%2], #4  \n"
		"   ldr %1, [%3]      \n"
		"   umaal %1, %4, %5, %0 \n"
		"   str %1, [%3], #4  \n"
		"   cmp %2, %6        \n"
		"   bne 1b            \n"
		: "=&r"(b), "=&r"(low), "+r"(y), "+r"(to), "+r"(carry)
		: "r"(a), "r"(end)
		: "cc", "memory");
	*to = carry;
#else
	uint64_t sum = 0;
	int j;

	for (j = 0; j < 8; j++) {
		sum += (uint64_t)a * y[j] + to[j];
		to[j] = (uint32_t)sum;
		sum >>= 32;
	}
	to[8] = (uint32_t)sum;
#endif
}

void f25519_mul__distinct(uint8_t *r, const uint8_t *a, const uint8_t *b)
{
	uint32_t product[16];
	uint32_t x[8];
	uint32_t y[8];
	uint64_t c;
	int i;

	for (i = 0; i < 8; i++) {
		x[i] = f25519_word(a + 4 * i);
		y[i] = f25519_word(b + 4 * i);
		product[i] = 0;
	}

	for (i = 0; i < 8; i++)
		f25519_add_row(product + i, x[i], y);

	/* Reduce with 2^256 = 38 mod p, then with 2^255 = 19 mod p */
	c = 0;
	for (i = 0; i < 8; i++) {
		c += (uint64_t)product[i + 8] * 38 + product[i];
		product[i] = (uint32_t)c;
		c >>= 32;
	}
	f25519_fold(r, product, (uint32_t)c);
}

void f25519_mul(uint8_t *r, const uint8_t *a, const uint8_t *b)
{
	uint8_t tmp[F25519_SIZE];

	f25519_mul__distinct(tmp, a, b);
	f25519_copy(r, tmp);
}

void f25519_mul_c(uint8_t *r, const uint8_t *a, uint32_t b)
{
	uint32_t c = 0;
	int i;

	for (i = 0; i < F25519_SIZE; i++) {
		c >>= 8;
		c += b * ((uint32_t)a[i]);
		r[i] = c;
	}

	r[31] &= 127;
	c >>= 7;
	c *= 19;

	for (i = 0; i < F25519_SIZE; i++) {
		c += r[i];
		r[i] = c;
		c >>= 8;
	}
}

void f25519_inv__distinct(uint8_t *r, const uint8_t *x)
{
	uint8_t s[F25519_SIZE];
	int i;

	/* This is a prime field, so by Fermat's little theorem:
	 *
	 *     x^(p-1) = 1 mod p
	 *
	 * Therefore, raise to (p-2) = 2^255-21 to get a multiplicative
	 * inverse.
	 *
	 * This is a 255-bit binary number with the digits:
	 *
	 *     11111111... 01011
	 *
	 * We compute the result by the usual binary chain, but
	 * alternate between keeping the accumulator in r and s, so as
	 * to avoid copying temporaries.
	 */

	/* 1 1 */
	f25519_mul__distinct(s, x, x);
	f25519_mul__distinct(r, s, x);

	/* 1 x 248 */
	for (i = 0; i < 248; i++) {
		f25519_mul__distinct(s, r, r);
		f25519_mul__distinct(r, s, x);
	}

	/* 0 */
	f25519_mul__distinct(s, r, r);

	/* 1 */
	f25519_mul__distinct(r, s, s);
	f25519_mul__distinct(s, r, x);

	/* 0 */
	f25519_mul__distinct(r, s, s);

	/* 1 */
	f25519_mul__distinct(s, r, r);
	f25519_mul__distinct(r, s, x);

	/* 1 */
	f25519_mul__distinct(s, r, r);
	f25519_mul__distinct(r, s, x);
}

void f25519_inv(uint8_t *r, const uint8_t *x)
{
	uint8_t tmp[F25519_SIZE];

	f25519_inv__distinct(tmp, x);
	f25519_copy(r, tmp);
}

/* Raise x to the power of (p-5)/8 = 2^252-3, using s for temporary
 * storage.
 */
static void exp2523(uint8_t *r, const uint8_t *x, uint8_t *s)
{
	int i;

	/* This number is a 252-bit number with the binary expansion:
	 *
	 *     111111... 01
	 */

	/* 1 1 */
	f25519_mul__distinct(r, x, x);
	f25519_mul__distinct(s, r, x);

	/* 1 x 248 */
	for (i = 0; i < 248; i++) {
		f25519_mul__distinct(r, s, s);
		f25519_mul__distinct(s, r, x);
	}

	/* 0 */
	f25519_mul__distinct(r, s, s);

	/* 1 */
	f25519_mul__distinct(s, r, r);
	f25519_mul__distinct(r, s, x);
}

void f25519_sqrt(uint8_t *r, const uint8_t *a)
{
	uint8_t v[F25519_SIZE];
	uint8_t i[F25519_SIZE];
	uint8_t x[F25519_SIZE];
	uint8_t y[F25519_SIZE];

	/* v = (2a)^((p-5)/8) [x = 2a] */
	f25519_mul_c(x, a, 2);
	exp2523(v, x, y);

	/* i = 2av^2 - 1 */
	f25519_mul__distinct(y, v, v);
	f25519_mul__distinct(i, x, y);
	f25519_load(y, 1);
	f25519_sub(i, i, y);

	/* r = avi */
	f25519_mul__distinct(x, v, a);
	f25519_mul__distinct(r, x, i);
}
