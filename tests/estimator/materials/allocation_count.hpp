#pragma once
// Counts calls of operator new in the calling thread (allocation_count.cpp replaces it for the whole
// program).

#include <cstddef>

namespace diastole {

size_t allocation_count();

}  // namespace diastole
