// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "questions.hpp"

namespace world_tests {

using jostle::Error;
using jostle::ErrorCode;
using Bytes = std::vector<std::byte>;

template <int Dim, class T>
bool same_results(const jostle::World<Dim, T>& a, const jostle::World<Dim, T>& b)
{
    const auto same = [](const auto& x, const auto& y) {
        return std::equal(x.begin(), x.end(), y.begin(), y.end());
    };
    return same(a.began(), b.began()) && same(a.ended(), b.ended()) &&
           a.persisted().to_vector() == b.persisted().to_vector() && // in the same order
           a.pairs().to_vector() == b.pairs().to_vector() && a.save() == b.save();
}

/// The code of the error that `call` throws, whose message has `words` in it.
template <class Call>
ErrorCode code_of(const std::string& words, const Call& call)
{
    try {
        call();
    } catch (const Error& error) {
        EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
        return error.code();
    }
    return {};
}

/// Every byte of `good` altered in three ways, every beginning of it, and one byte more; `error_of_restoring`
/// tries them.
template <class ErrorOfRestoring>
void expect_refused_when_altered(const Bytes& good, const ErrorOfRestoring& error_of_restoring)
{
    for (std::size_t i = 0; i < good.size(); ++i) {
        for (const int flip : {0x01, 0x80, 0xff}) {
            Bytes bad = good;
            bad[i] ^= static_cast<std::byte>(flip);
            ASSERT_EQ(error_of_restoring(bad), ErrorCode::bad_snapshot) << "byte " << i;
        }
        ASSERT_EQ(error_of_restoring(Bytes(good.begin(), good.begin() + static_cast<long>(i))),
                  ErrorCode::bad_snapshot)
            << "cut at " << i;
    }
    Bytes longer = good;
    longer.push_back({});
    EXPECT_EQ(error_of_restoring(longer), ErrorCode::bad_snapshot);
}

template <class Number>
void write(Bytes& bytes, std::size_t at, Number number)
{
    for (std::size_t k = 0; k < sizeof number; ++k)
        bytes[at + k] = static_cast<std::byte>(number >> (8 * k));
}

/// Writes the checksum of the layout again.
inline void seal(Bytes& bytes)
{
    std::fill_n(bytes.begin() + 32, 8, std::byte{0});
    std::uint64_t sum = 0x9e3779b97f4a7c15u;
    for (std::size_t i = 0; i < bytes.size(); i += 8) {
        std::uint64_t word = 0;
        for (std::size_t k = 0; k < 8 && i + k < bytes.size(); ++k)
            word |= std::uint64_t{static_cast<unsigned char>(bytes[i + k])} << (8 * k);
        sum = (sum ^ word) * 0xbf58476d1ce4e5b9u;
        sum ^= sum >> 32;
    }
    for (std::size_t k = 0; k < 8; ++k)
        bytes[32 + k] = static_cast<std::byte>(sum >> (8 * k));
}

/// Of what has grown or shrunk: writes its size again, and the checksum.
inline void seal_with_size(Bytes& bytes)
{
    for (std::size_t k = 0; k < 8; ++k)
        bytes[24 + k] = static_cast<std::byte>((bytes.size() - 48) >> (8 * k));
    seal(bytes);
}

} // namespace world_tests
