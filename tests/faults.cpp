#include "faults.h"

#include <dlfcn.h>
#include <fcntl.h>

#include <cerrno>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <new>

namespace doppel::test {
namespace {

struct Armed {
  bool on = false;
  Fault fault = Fault::allocation;
  std::uint64_t n = 0, seen = 0;
};
thread_local Armed armed;

}  // namespace

void arm(Fault fault, std::uint64_t n) {
  armed = {true, fault, n, 0};
}

std::uint64_t disarm() {
  armed.on = false;
  return armed.seen;
}

bool strikes(Fault fault) {
  if (!armed.on || armed.fault != fault) return false;
  return ++armed.seen == armed.n;
}

namespace {

// libstdc++ 12 assumes that a variant of strings and vectors is never valueless and, if copying one fails,
// destroys what was not constructed; so allocations up to the size of a description, which is such a string,
// never fail.
constexpr std::size_t kMinFaultSize = 64 * 1024;

void* take(std::size_t size, std::size_t alignment) {
  void* const memory = size >= kMinFaultSize && strikes(Fault::allocation) ? nullptr
                       : alignment == 0
                           ? std::malloc(size == 0 ? 1 : size)
                           : std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

template <typename Function>
Function next(const char* name) {
  return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));  // NOLINT
}

}  // namespace
}  // namespace doppel::test

using doppel::test::Fault;

// g++ inlines a delete into a caller, then warns that free() receives what operator new returned.
#pragma GCC diagnostic ignored "-Wmismatched-new-delete"

void* operator new(std::size_t size) {
  return doppel::test::take(size, 0);
}
void* operator new[](std::size_t size) {
  return doppel::test::take(size, 0);
}
void* operator new(std::size_t size, std::align_val_t alignment) {
  return doppel::test::take(size, static_cast<std::size_t>(alignment));
}
void* operator new[](std::size_t size, std::align_val_t alignment) {
  return doppel::test::take(size, static_cast<std::size_t>(alignment));
}
// AddressSanitizer has one of its own otherwise, whose memory free() must not get.
void* operator new(std::size_t size, const std::nothrow_t& /*never_throws*/) noexcept {
  try {
    return doppel::test::take(size, 0);
  } catch (const std::bad_alloc&) {
    return nullptr;
  }
}
void* operator new[](std::size_t size, const std::nothrow_t& never_throws) noexcept {
  return operator new(size, never_throws);
}
void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete[](void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t /*size*/) noexcept {
  std::free(memory);
}
void operator delete[](void* memory, std::size_t /*size*/) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::align_val_t /*alignment*/) noexcept {
  std::free(memory);
}
void operator delete[](void* memory, std::align_val_t /*alignment*/) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t /*size*/, std::align_val_t /*alignment*/) noexcept {
  std::free(memory);
}
void operator delete[](void* memory, std::size_t /*size*/, std::align_val_t /*alignment*/) noexcept {
  std::free(memory);
}

namespace {

using doppel::test::next;
using doppel::test::strikes;

FILE* open_stream(const char* real, const char* path, const char* mode) {
  if (!strikes(Fault::file)) return next<FILE* (*)(const char*, const char*)>(real)(path, mode);
  errno = EIO;
  return nullptr;
}

int open_file(const char* real, const char* path, int flags, va_list arguments) {
  const auto mode = (flags & (O_CREAT | O_TMPFILE)) != 0 ? va_arg(arguments, unsigned) : 0U;
  if (!strikes(Fault::file)) return next<int (*)(const char*, int, ...)>(real)(path, flags, mode);
  errno = EIO;
  return -1;
}

}  // namespace

// Replaces the C library's functions: the program's own take precedence.
extern "C" {

FILE* fopen(const char* path, const char* mode) {
  return open_stream("fopen", path, mode);
}

FILE* fopen64(const char* path, const char* mode) {
  return open_stream("fopen64", path, mode);
}

int open(const char* path, int flags, ...) {
  va_list arguments;
  va_start(arguments, flags);
  const int file = open_file("open", path, flags, arguments);
  va_end(arguments);
  return file;
}

int open64(const char* path, int flags, ...) {
  va_list arguments;
  va_start(arguments, flags);
  const int file = open_file("open64", path, flags, arguments);
  va_end(arguments);
  return file;
}
}
