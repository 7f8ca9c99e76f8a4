// SPDX-License-Identifier: MIT
// Any bytes as an NPY file, or as they come through a pipe, of unknown length: what is taken of one
// is taken of the other. What is read is read again from the plainest file of the same boxes.
#include <cstring>

#include "read_file.hpp"

JOSTLE_FUZZ_TARGET(npy)
{
    const std::vector<std::uint8_t> bytes = in.rest();
    const bool has_size = bytes.size() % 2 == 0;
    const auto read = fuzz::read_or_refuse(bytes, jostle_tool::read_npy, has_size);
    if (!read) return;
    const auto other = fuzz::read_or_refuse(bytes, jostle_tool::read_npy, !has_size);
    fuzz::demand(other && fuzz::same_boxes(*read, *other), "a file and a pipe of the same bytes differ");
    std::string plain;
    std::visit(
        [&](const auto& boxes) {
            using Box = typename std::decay_t<decltype(boxes)>::value_type;
            using T = typename decltype(Box::lo)::value_type;
            fuzz::demand(boxes.size() * sizeof(Box) < bytes.size(), "more boxes than the file has bytes for");
            std::string header = std::string("{'descr': '<f") + (sizeof(T) == 4 ? "4" : "8") +
                                 "', 'fortran_order': False, 'shape': (" + std::to_string(boxes.size()) +
                                 ", " + std::to_string(sizeof(Box) / sizeof(T)) + "), }\n";
            plain = std::string("\x93NUMPY\x01\x00", 8);
            plain += static_cast<char>(header.size());
            plain += '\0';
            plain += header;
            plain.append(reinterpret_cast<const char*>(boxes.data()), boxes.size() * sizeof(Box));
            fuzz::count_boxes(boxes.size());
        },
        read->boxes);
    const auto again = fuzz::read_or_refuse(plain, jostle_tool::read_npy);
    fuzz::demand(again && fuzz::same_boxes(*read, *again), "a plain file of the same boxes reads as others");
}
