#pragma once
// Marks the exports of libdoppel.so: everything else in it is hidden. tools/check_exports holds the public
// headers to it.

#define DOPPEL_API __attribute__((visibility("default")))
