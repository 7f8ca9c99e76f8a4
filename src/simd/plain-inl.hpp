// SPDX-License-Identifier: MIT
// The vocabulary of simd/vec-inl.hpp without SIMD: a vector is one number, a mask one truth. No include
// guard, on purpose.

template <class T>
struct Mask
{
    bool raw;
};

template <class T>
struct Vec
{
    static constexpr std::uint32_t size = 1;
    T raw;

    Vec() = default;
    explicit Vec(T value) : raw(value) {}
    static Vec load(const T* from) { return Vec(*from); }
    static Vec loadu(const T* from) { return Vec(*from); }
    static Vec lane_numbers() { return Vec(T(0)); }
    void store(T* to) const { *to = raw; }
    void storeu(T* to) const { *to = raw; }
};

template <class T>
inline Vec<T> operator+(Vec<T> a, Vec<T> b)
{
    return Vec<T>(static_cast<T>(a.raw + b.raw));
}
template <class T>
inline Vec<T> operator-(Vec<T> a, Vec<T> b)
{
    return Vec<T>(static_cast<T>(a.raw - b.raw));
}
template <class T>
inline Vec<T> operator*(Vec<T> a, Vec<T> b)
{
    return Vec<T>(static_cast<T>(a.raw * b.raw));
}
template <class T>
inline Vec<T> operator/(Vec<T> a, Vec<T> b)
{
    return Vec<T>(static_cast<T>(a.raw / b.raw));
}
template <class T>
inline Mask<T> operator<(Vec<T> a, Vec<T> b)
{
    return {a.raw < b.raw};
}
template <class T>
inline Mask<T> operator<=(Vec<T> a, Vec<T> b)
{
    return {a.raw <= b.raw};
}
template <class T>
inline Mask<T> operator>(Vec<T> a, Vec<T> b)
{
    return {a.raw > b.raw};
}
template <class T>
inline Mask<T> operator>=(Vec<T> a, Vec<T> b)
{
    return {a.raw >= b.raw};
}
template <class T>
inline Vec<T> min(Vec<T> a, Vec<T> b)
{
    return a.raw < b.raw ? a : b;
}
template <class T>
inline Vec<T> max(Vec<T> a, Vec<T> b)
{
    return a.raw > b.raw ? a : b;
}
template <class T>
inline Vec<T> abs(Vec<T> a)
{
    return Vec<T>(std::abs(a.raw));
}
template <class T>
inline Vec<T> sqrt(Vec<T> a)
{
    return Vec<T>(std::sqrt(a.raw));
}
template <class T>
inline T min_lane(Vec<T> a)
{
    return a.raw;
}
template <class T>
inline T max_lane(Vec<T> a)
{
    return a.raw;
}
template <class T>
inline Vec<T> choose(Mask<T> mask, Vec<T> yes, Vec<T> no)
{
    return mask.raw ? yes : no;
}

template <class T>
inline Mask<T> operator&(Mask<T> a, Mask<T> b)
{
    return {a.raw && b.raw};
}
template <class T>
inline Mask<T> operator|(Mask<T> a, Mask<T> b)
{
    return {a.raw || b.raw};
}
template <class T>
inline bool any(Mask<T> mask)
{
    return mask.raw;
}
template <class T>
inline bool all(Mask<T> mask)
{
    return mask.raw;
}
template <class T>
inline unsigned mask_bits(Mask<T> mask)
{
    return mask.raw ? 1 : 0;
}
