// SPDX-License-Identifier: MIT
// What the searches need of a vector: a few operations on `lanes` numbers at a time or a part of them.
// Included once per instruction set, inside its namespace. Without SIMD a vector is one number.

#if JOSTLE_INDEX_SCALAR

template <class T>
struct Vec
{
    using Mask = bool;
    static constexpr std::uint32_t size = 1;
    T v;
    static Vec load(const T* from) { return {*from}; }
    static Vec set(T value) { return {value}; }
    void store(T* to) const { *to = v; }
    static unsigned bits(Mask mask) { return mask ? 1 : 0; }
    static Vec choose(Mask mask, Vec yes, Vec no) { return mask ? yes : no; }
    T least_lane() const { return v; }
};
template <class T>
inline Vec<T> operator+(Vec<T> a, Vec<T> b)
{
    return {a.v + b.v};
}
template <class T>
inline Vec<T> operator-(Vec<T> a, Vec<T> b)
{
    return {a.v - b.v};
}
template <class T>
inline Vec<T> operator*(Vec<T> a, Vec<T> b)
{
    return {a.v * b.v};
}
template <class T>
inline bool operator<(Vec<T> a, Vec<T> b)
{
    return a.v < b.v;
}
template <class T>
inline bool operator<=(Vec<T> a, Vec<T> b)
{
    return a.v <= b.v;
}
template <class T>
inline Vec<T> least(Vec<T> a, Vec<T> b)
{
    return {a.v < b.v ? a.v : b.v};
}
template <class T>
inline Vec<T> greatest(Vec<T> a, Vec<T> b)
{
    return {a.v > b.v ? a.v : b.v};
}
inline bool both(bool a, bool b)
{
    return a && b;
}
inline bool either(bool a, bool b)
{
    return a || b;
}

#else

template <class T>
struct Vec
{
    using D = hn::CappedTag<T, lanes>;
    using Mask = hn::Mask<D>;
    static constexpr std::uint32_t size = static_cast<std::uint32_t>(hn::MaxLanes(D()));
    hn::Vec<D> v;
    static HWY_ATTR HWY_INLINE Vec load(const T* from) { return {hn::Load(D(), from)}; }
    static HWY_ATTR HWY_INLINE Vec set(T value) { return {hn::Set(D(), value)}; }
    HWY_ATTR HWY_INLINE void store(T* to) const { hn::Store(v, D(), to); }
    static HWY_ATTR HWY_INLINE Vec choose(Mask mask, Vec yes, Vec no)
    {
        return {hn::IfThenElse(mask, yes.v, no.v)};
    }
    HWY_ATTR HWY_INLINE T least_lane() const { return hn::GetLane(hn::MinOfLanes(D(), v)); }
    static HWY_ATTR HWY_INLINE unsigned bits(Mask mask)
    {
#if HWY_TARGET == HWY_AVX3
        return static_cast<unsigned>(mask.raw);
#else
        std::uint8_t bytes[8] = {};
        hn::StoreMaskBits(D(), mask, bytes);
        return bytes[0] | static_cast<unsigned>(bytes[1]) << 8;
#endif
    }
};
template <class T>
HWY_ATTR HWY_INLINE Vec<T> operator+(Vec<T> a, Vec<T> b)
{
    return {hn::Add(a.v, b.v)};
}
template <class T>
HWY_ATTR HWY_INLINE Vec<T> operator-(Vec<T> a, Vec<T> b)
{
    return {hn::Sub(a.v, b.v)};
}
template <class T>
HWY_ATTR HWY_INLINE Vec<T> operator*(Vec<T> a, Vec<T> b)
{
    return {hn::Mul(a.v, b.v)};
}
template <class T>
HWY_ATTR HWY_INLINE auto operator<(Vec<T> a, Vec<T> b)
{
    return hn::Lt(a.v, b.v);
}
template <class T>
HWY_ATTR HWY_INLINE auto operator<=(Vec<T> a, Vec<T> b)
{
    return hn::Le(a.v, b.v);
}
template <class T>
HWY_ATTR HWY_INLINE Vec<T> least(Vec<T> a, Vec<T> b)
{
    return {hn::Min(a.v, b.v)};
}
template <class T>
HWY_ATTR HWY_INLINE Vec<T> greatest(Vec<T> a, Vec<T> b)
{
    return {hn::Max(a.v, b.v)};
}
template <class Mask>
HWY_ATTR HWY_INLINE Mask both(Mask a, Mask b)
{
    return hn::And(a, b);
}
template <class Mask>
HWY_ATTR HWY_INLINE Mask either(Mask a, Mask b)
{
    return hn::Or(a, b);
}

#endif
