#pragma once
// What libdoppel.so exports: everything else in it is hidden. tools/check_exports holds the public
// headers to it.

#define DOPPEL_API __attribute__((visibility("default")))
