// SPDX-License-Identifier: MIT
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "jostle/error.hpp"

namespace contract {

/// The Error that call() throws; a failure where it throws none.
template <class Call>
jostle::Error error_of(const Call& call)
{
    try {
        (void)call();
    } catch (const jostle::Error& error) {
        return error;
    }
    ADD_FAILURE() << "no Error was thrown";
    return {jostle::ErrorCode{}, "no Error was thrown"};
}

template <class Call>
std::string message_of(const Call& call)
{
    return error_of(call).what();
}

/// The message of the Error that call() throws, which must have this code.
template <class Call>
std::string refusal(jostle::ErrorCode code, const Call& call)
{
    const jostle::Error error = error_of(call);
    EXPECT_EQ(error.code(), code) << error.what();
    return error.what();
}

} // namespace contract
