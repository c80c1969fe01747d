#include "doppel/physics/engines/mujoco/state_data.h"

#include <mujoco/mjxmacro.h>

#include <cstddef>
#include <cstring>
#include <new>
#include <string_view>

namespace doppel {

// From 2.3 on MuJoCo itself keeps rows in an arena and copies only the part in use.
static_assert(mjVERSION_HEADER < 230, "make and copy an mjData by MuJoCo's own functions");

namespace {

constexpr std::size_t kAlignment = 64;  // a cache line, as for MuJoCo's own arrays

enum class Kind { fixed, rows, dual };

// Of an array of mjData by its two dimensions, as mjxmacro.h spells them.
constexpr Kind kind_of(std::string_view rows, std::string_view columns) {
  const bool grows_down = rows == "njmax" || rows == "nconmax";
  const bool grows_across = columns == "MJ_M(njmax)";
  return grows_down && grows_across ? Kind::dual : grows_down || grows_across ? Kind::rows : Kind::fixed;
}

constexpr std::size_t aligned(std::size_t bytes) {
  return (bytes + kAlignment - 1) / kAlignment * kAlignment;
}

constexpr std::size_t product(std::size_t element, int rows, int columns) {
  return element * static_cast<std::size_t>(rows) * static_cast<std::size_t>(columns);
}

// Bytes of all arrays of a kind. Where `data` is not null, they begin at `at`, in MuJoCo's order.
std::size_t place(const mjModel* m, Kind kind, mjData* data, std::byte* at) {
  std::size_t bytes = 0;
  MJDATA_POINTERS_PREAMBLE(m)
#define X(type, name, nr, nc)                                              \
  if (kind_of(#nr, #nc) == kind) {                                         \
    if (data != nullptr) data->name = reinterpret_cast<type*>(at + bytes); \
    bytes += aligned(product(sizeof(type), m->nr, nc));                    \
  }
  MJDATA_POINTERS
#undef X
  return bytes;
}

// Copies the part of the rows' arrays that belongs to present constraints and contacts.
void copy_rows(const mjModel* m, mjData* to, const mjData* from) {
  const int nv = m->nv, njmax = from->nefc;
#define X(type, name, nr, nc)                                                          \
  if constexpr (kind_of(#nr, #nc) == Kind::rows) {                                     \
    const std::string_view down = #nr;                                                 \
    const int rows = down == "njmax" ? njmax : down == "nconmax" ? from->ncon : m->nr; \
    std::memcpy(to->name, from->name, product(sizeof(type), rows, nc));                \
  }
  MJDATA_POINTERS
#undef X
}

}  // namespace

// The struct, the arrays, the rows and the stack are one block, so that untouched pages cost nothing.
DataHandle make_data(const mjModel* model) {
  const std::size_t head = aligned(sizeof(mjData));
  const std::size_t fixed = place(model, Kind::fixed, nullptr, nullptr);
  const std::size_t rows = place(model, Kind::rows, nullptr, nullptr);
  const std::size_t stack = sizeof(mjtNum) * static_cast<std::size_t>(model->nstack);
  auto* const block =
      static_cast<std::byte*>(::operator new (head + fixed + rows + stack, std::align_val_t{kAlignment}));
  DataHandle out(new (block) mjData);
  out->buffer = block + head;
  out->nbuffer = static_cast<int>(fixed);  // the part that mj_resetData clears
  place(model, Kind::fixed, out.get(), block + head);
  place(model, Kind::rows, out.get(), block + head + fixed);
  out->efc_AR = nullptr;
  out->efc_AR_colind = nullptr;
  out->stack = reinterpret_cast<mjtNum*>(block + head + fixed + rows);
  out->nstack = model->nstack;
  mj_resetData(model, out.get());
  return out;
}

void DataDeleter::operator()(mjData* data) const {
  ::operator delete (data, std::align_val_t{kAlignment});
}

void copy_data(const mjModel* model, mjData* to, const mjData* from) {
#define X(type, name) to->name = from->name;
  MJDATA_SCALAR
#undef X
  std::memcpy(to->warning, from->warning, sizeof to->warning);
  std::memcpy(to->solver_fwdinv, from->solver_fwdinv, sizeof to->solver_fwdinv);
  std::memcpy(to->energy, from->energy, sizeof to->energy);
  std::memcpy(to->buffer, from->buffer, static_cast<std::size_t>(from->nbuffer));
  copy_rows(model, to, from);
}

}  // namespace doppel
