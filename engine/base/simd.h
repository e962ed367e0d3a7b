// Packs of doubles in vector registers, on the vector extensions that GCC and Clang share: 8 lanes with AVX-512, 4 with AVX2, 2
// anywhere else. What is written for a Real (double or a pack) holds for one contact or for a register full of them.
//
// Rows of memory (a particle, a force) become columns, a lane a row, by the square transposition of Pack<lanes> registers:
// 8 x 8 takes 24 shuffles and replaces 64 loads (the method of the 8-point transform; Hacker's Delight 7-3).
#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#if defined(__SSE2__)
#include <immintrin.h>
#endif

namespace bedflow {

template <int lanes>
struct PackOf {
  typedef double type __attribute__((vector_size(lanes * sizeof(double))));
  typedef double unaligned __attribute__((vector_size(lanes * sizeof(double)), aligned(sizeof(double)), may_alias));
};
template <int lanes>
using Pack = typename PackOf<lanes>::type;

#if defined(__AVX512F__) && defined(__AVX512DQ__) && defined(__AVX512VL__)
inline constexpr int native_lanes = 8;
#elif defined(__AVX2__)
inline constexpr int native_lanes = 4;
#else
inline constexpr int native_lanes = 2;
#endif

template <class T>
inline constexpr bool is_pack = std::is_same_v<T, Pack<2>> || std::is_same_v<T, Pack<4>> || std::is_same_v<T, Pack<8>>;
template <class T>
concept PackLike = is_pack<T>;
template <PackLike T>
inline constexpr int lanes_of = sizeof(T) / sizeof(double);

// ---------------------------------------------------------------------------------------------------- one value or a pack

inline double sqrt(double value) {
  return std::sqrt(value);
}
inline double abs(double value) {
  return std::abs(value);
}
inline double min(double a, double b) {  // a when b is not a number
  return b < a ? b : a;
}
inline double max(double a, double b) {
  return b > a ? b : a;
}
inline double floor(double value) {
  return std::floor(value);
}
inline double select(bool condition, double yes, double no) {
  return condition ? yes : no;
}

template <PackLike P>
P sqrt(P value) {
  P result;
  for (int l = 0; l < lanes_of<P>; ++l) result[l] = std::sqrt(value[l]);
  return result;
}
template <PackLike P>
P abs(P value) {
  return value < 0 ? -value : value;
}
template <PackLike P>
P min(P a, P b) {
  return b < a ? b : a;
}
template <PackLike P>
P max(P a, P b) {
  return b > a ? b : a;
}
template <PackLike P>
P floor(P value) {
#if defined(__AVX512F__) && defined(__AVX512DQ__) && defined(__AVX512VL__)
  if constexpr (lanes_of<P> == 8) return std::bit_cast<P>(_mm512_floor_pd(std::bit_cast<__m512d>(value)));
#endif
  P result;
  for (int l = 0; l < lanes_of<P>; ++l) result[l] = std::floor(value[l]);
  return result;
}
template <class Mask, PackLike P>
P select(Mask condition, P yes, P no) {
  return condition ? yes : no;
}

template <class Real>
Real broadcast(double value) {
  if constexpr (PackLike<Real>) {
    return Real{} + value;
  } else {
    return value;
  }
}
template <PackLike P>
double largest(P value) {
  double result = value[0];
  for (int l = 1; l < lanes_of<P>; ++l) result = max(result, value[l]);
  return result;
}
// Bit l is set where lane l of a comparison holds.
template <class Mask>
unsigned bits_of(Mask mask) {
  constexpr int lanes = sizeof(Mask) / sizeof(double);
#if defined(__AVX512DQ__) && defined(__AVX512VL__)
  if constexpr (lanes == 8) return _cvtmask8_u32(_mm512_movepi64_mask(std::bit_cast<__m512i>(mask)));
#endif
#if defined(__AVX__)
  if constexpr (lanes == 4) return static_cast<unsigned>(_mm256_movemask_pd(std::bit_cast<__m256d>(mask)));
#endif
  unsigned bits = 0;
  for (int l = 0; l < lanes; ++l) bits |= mask[l] != 0 ? 1u << l : 0u;
  return bits;
}

// ---------------------------------------------------------------------------------------------------- memory

template <int lanes>
Pack<lanes> load(const double* from) {
  return *reinterpret_cast<const typename PackOf<lanes>::unaligned*>(from);
}
template <PackLike P>
void store(double* to, P value) {
  *reinterpret_cast<typename PackOf<lanes_of<P>>::unaligned*>(to) = value;
}

// The doubles of a register of 8 from `part` on.
template <int lanes>
Pack<lanes> part_of(const Pack<8>& whole, int part) {
  if constexpr (lanes == 8) return whole;
  Pack<lanes> result;
  for (int l = 0; l < lanes; ++l) result[l] = whole[part + l];
  return result;
}

// Copies the elements of values[0 … lanes) whose bit is set to the front of `to`, which has room for all; returns how many.
template <int lanes, class T>
requires(sizeof(T) == 8 && std::is_trivially_copyable_v<T>) std::size_t copy_set(const T* values, unsigned bits, T* to) {
#if defined(__AVX512F__)
  if constexpr (lanes == 8) {
    _mm512_storeu_si512(to, _mm512_maskz_compress_epi64(static_cast<__mmask8>(bits), _mm512_loadu_si512(values)));
    return static_cast<std::size_t>(std::popcount(bits));
  }
#endif
  std::size_t count = 0;
  for (int l = 0; l < lanes; ++l) {
    to[count] = values[l];
    count += bits >> l & 1;
  }
  return count;
}

// The 4 x 4 blocks that the lower and the upper halves of four rows form, each transposed.
inline void transpose_halves(Pack<8>* rows) {
  Pack<8> pairs[4];
  for (int i = 0; i < 4; i += 2) {
    pairs[i] = __builtin_shufflevector(rows[i], rows[i + 1], 0, 8, 2, 10, 4, 12, 6, 14);
    pairs[i + 1] = __builtin_shufflevector(rows[i], rows[i + 1], 1, 9, 3, 11, 5, 13, 7, 15);
  }
  for (int i = 0; i < 2; ++i) {
    rows[i] = __builtin_shufflevector(pairs[i], pairs[i + 2], 0, 1, 8, 9, 4, 5, 12, 13);
    rows[i + 2] = __builtin_shufflevector(pairs[i], pairs[i + 2], 2, 3, 10, 11, 6, 7, 14, 15);
  }
}

// rows[r][c] becomes rows[c][r].
template <int lanes>
void transpose(Pack<lanes>* rows) {
  if constexpr (lanes == 2) {
    const Pack<2> a = rows[0], b = rows[1];
    rows[0] = __builtin_shufflevector(a, b, 0, 2);
    rows[1] = __builtin_shufflevector(a, b, 1, 3);
  } else if constexpr (lanes == 4) {
    Pack<4> pairs[4];
    for (int i = 0; i < 4; i += 2) {
      pairs[i] = __builtin_shufflevector(rows[i], rows[i + 1], 0, 4, 2, 6);
      pairs[i + 1] = __builtin_shufflevector(rows[i], rows[i + 1], 1, 5, 3, 7);
    }
    for (int i = 0; i < 2; ++i) {
      rows[i] = __builtin_shufflevector(pairs[i], pairs[i + 2], 0, 1, 4, 5);
      rows[i + 2] = __builtin_shufflevector(pairs[i], pairs[i + 2], 2, 3, 6, 7);
    }
  } else {
    transpose_halves(rows);
    transpose_halves(rows + 4);
    for (int k = 0; k < 4; ++k) {
      const Pack<8> a = rows[k], b = rows[k + 4];
      rows[k] = __builtin_shufflevector(a, b, 0, 1, 2, 3, 8, 9, 10, 11);
      rows[k + 4] = __builtin_shufflevector(a, b, 4, 5, 6, 7, 12, 13, 14, 15);
    }
  }
}

// Rows of 8 doubles, one a lane, as 8 columns; and back. row(l, part) is the part of row l that starts at its double part.
template <int lanes, class Row>
std::array<Pack<lanes>, 8> columns_of_eight(Row row) {
  std::array<Pack<lanes>, 8> columns;
  for (int part = 0; part < 8; part += lanes) {
    for (int l = 0; l < lanes; ++l) columns[part + l] = row(l, part);
    transpose<lanes>(columns.data() + part);
  }
  return columns;
}
template <int lanes, class Take>
void rows_of_eight(std::array<Pack<lanes>, 8> columns, Take take) {
  for (int part = 0; part < 8; part += lanes) {
    transpose<lanes>(columns.data() + part);
    for (int l = 0; l < lanes; ++l) take(l, part, columns[part + l]);
  }
}

// Rows of 4 doubles, one a lane, as 4 columns; and back for the first `count` lanes. row(l, part) is the part of row l that
// starts at its double part; to(l) points to row l.
template <int lanes, class Row>
std::array<Pack<lanes>, 4> columns_of_four(Row row) {
  std::array<Pack<lanes>, 4> columns;
  if constexpr (lanes <= 4) {
    for (int part = 0; part < 4; part += lanes) {
      for (int l = 0; l < lanes; ++l) columns[part + l] = row(l, part);
      transpose<lanes>(columns.data() + part);
    }
  } else {
    for (int l = 0; l < 4; ++l) columns[l] = __builtin_shufflevector(row(l, 0), row(l + 4, 0), 0, 1, 2, 3, 4, 5, 6, 7);
    transpose_halves(columns.data());
  }
  return columns;
}
template <int lanes, class To>
void rows_of_four(std::array<Pack<lanes>, 4> columns, int count, To to) {
  if constexpr (lanes <= 4) {
    for (int part = 0; part < 4; part += lanes) {
      transpose<lanes>(columns.data() + part);
      for (int l = 0; l < lanes && l < count; ++l) store(to(l) + part, columns[part + l]);
    }
  } else {
    transpose_halves(columns.data());
    for (int l = 0; l < 4; ++l) {
      if (l < count) store(to(l), __builtin_shufflevector(columns[l], columns[l], 0, 1, 2, 3));
      if (l + 4 < count) store(to(l + 4), __builtin_shufflevector(columns[l], columns[l], 4, 5, 6, 7));
    }
  }
}

}  // namespace bedflow
