#pragma once
// Marks the exports of libdoppel.so and libdoppel_tools.so: everything else in them is hidden.
// tools/check_exports holds the public headers to it.

#define DOPPEL_API __attribute__((visibility("default")))
