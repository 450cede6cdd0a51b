#pragma once
#include <stdexcept>

namespace app {

/// Bad usage or bad input: the program prints what() as its one line on standard error and ends with
/// status 2. The text: [FILE[:LINE:COLUMN]: ]error: found ..., expected ...; what to do.
class BadInput : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

}  // namespace app
