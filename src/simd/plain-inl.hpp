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
template <class T>
inline Vec<T> compress(Vec<T> all, unsigned)
{
    return all;
}

[[maybe_unused]] inline void load_rows(const float (*rows)[4], Vec<float>& x, Vec<float>& y, Vec<float>& z)
{
    x = Vec<float>((*rows)[0]);
    y = Vec<float>((*rows)[1]);
    z = Vec<float>((*rows)[2]);
}

struct Four
{
    float raw[4];

    static Four loadu(const float* from) { return {{from[0], from[1], from[2], from[3]}}; }
    void storeu(float* to) const
    {
        for (int i = 0; i < 4; ++i)
            to[i] = raw[i];
    }
};
[[maybe_unused]] inline Four operator+(const Four& a, const Four& b)
{
    return {{a.raw[0] + b.raw[0], a.raw[1] + b.raw[1], a.raw[2] + b.raw[2], a.raw[3] + b.raw[3]}};
}
[[maybe_unused]] inline Four operator-(const Four& a, const Four& b)
{
    return {{a.raw[0] - b.raw[0], a.raw[1] - b.raw[1], a.raw[2] - b.raw[2], a.raw[3] - b.raw[3]}};
}
[[maybe_unused]] inline void transpose(Four (&rows)[4])
{
    for (int i = 0; i < 4; ++i)
        for (int j = 0; j < i; ++j) {
            const float held = rows[i].raw[j];
            rows[i].raw[j] = rows[j].raw[i];
            rows[j].raw[i] = held;
        }
}
