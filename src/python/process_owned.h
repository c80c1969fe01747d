#pragma once
// Objects with files, sockets and threads, which belong to the process that made them. A process that fork()
// makes has copies of them without the threads: a destructor there would write into the parent's files, close
// its connections and wait for threads that do not exist. Copies are let go instead.

#include <fmt/format.h>
#include <unistd.h>

#include <memory>

#include "doppel/base/core/diagnostic.h"

namespace doppel::python {

class OwningProcess {
 public:
  [[nodiscard]] bool is_this_one() const { return getpid() == pid_; }
  // Throws InputError "python.forked" in another process. `object`: "the twin".
  void check(const char* object) const {
    if (is_this_one()) return;
    throw InputError(
        "python.forked", {},
        fmt::format("{} belongs to the process that made it, and this one is a fork of it", object),
        "make another one in this process, or start processes by multiprocessing's 'spawn'");
  }

 private:
  pid_t pid_ = getpid();
};

template <class T>
class DeleteByOwner {
 public:
  DeleteByOwner() = default;
  DeleteByOwner(std::default_delete<T> /*of std::make_unique*/) {}  // NOLINT(google-explicit-constructor)
  void operator()(T* object) const {
    if (process_.is_this_one()) delete object;
  }

 private:
  OwningProcess process_;
};

template <class T>
using ProcessOwned = std::unique_ptr<T, DeleteByOwner<T>>;

}  // namespace doppel::python
