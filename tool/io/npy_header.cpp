// SPDX-License-Identifier: MIT
#include "npy_header.hpp"

#include <bit>

namespace jostle_tool {

std::string npy_header(const std::string& type, const std::string& shape)
{
    const char* byte_order = std::endian::native == std::endian::little ? "<" : ">";
    std::string text = std::string("{'descr': '") + byte_order + type +
                       "', 'fortran_order': False, 'shape': " + shape + ", }";
    const std::size_t before = 10; // magic, version, length
    while ((before + text.size() + 1) % 64 != 0)
        text += ' ';
    text += '\n';
    std::string header("\x93NUMPY\x01\x00", 8);
    header += static_cast<char>(text.size() & 0xff);
    header += static_cast<char>(text.size() >> 8);
    return header + text;
}

} // namespace jostle_tool
