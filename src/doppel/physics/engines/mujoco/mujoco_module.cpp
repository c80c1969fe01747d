// The exports of the module: the engine, and the functions of mujoco_extras.h beyond the contract.

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstring>

#include "doppel/export.h"
#include "doppel/physics/engines/mujoco/mujoco_engine.h"

namespace doppel {
namespace {

std::string version_text() {
  const int version = mj_version();
  const int minor_base = version >= 1000 ? 1000000 : 100;  // 222 is 2.2.2; from 3.5 on 3005000 is 3.5.0
  const int minor_unit = version >= 1000 ? 1000 : 10;
  return fmt::format("{}.{}.{}", version / minor_base, version % minor_base / minor_unit,
                     version % minor_unit);
}

EngineCapabilities capabilities_of_mujoco() {
  EngineCapabilities out;
  out.name = "mujoco";
  out.version = version_text();
  out.contacts = out.rays = out.floating = out.planar = true;
  out.mimics = out.friction = out.stops = out.ideal = out.directed_friction = out.attachments = true;
  out.heightmaps = out.bounce = true;
  out.integrators = {Integrator::euler, Integrator::midpoint, Integrator::rk4, Integrator::implicit};
  // Measured values with a margin. Friction is a soft constraint and creeps; a hull penetrates a box
  // by 0.3 mm.
  out.tolerances = {.period = 3e-6,
                    .free_fall = 1e-12,
                    .holding = 1e-11,
                    .sag = 1e-11,
                    .stiction = 1e-5,
                    .mimic = 1e-6,
                    .penetration = 1e-3};
  return out;
}

std::shared_ptr<const CompiledWorld> compile(WorldSettings settings, std::vector<ModelInstance> instances,
                                             Diagnostics& diagnostics) {
  return std::make_shared<const MujocoWorld>(std::move(settings), std::move(instances), nullptr, diagnostics);
}

const EngineModule kModule{capabilities_of_mujoco(), &compile};

}  // namespace

const EngineCapabilities& MujocoWorld::capabilities() const {
  return kModule.capabilities;
}

std::unique_ptr<Engine> MujocoWorld::make_engine() const {
  return std::make_unique<MujocoEngine>(std::static_pointer_cast<const MujocoWorld>(shared_from_this()));
}

}  // namespace doppel

DOPPEL_EXPORT_ENGINE(doppel::kModule)

namespace {

template <typename Number>
bool same_bits(const Number* a, const Number* b, int count) {
  return std::memcmp(a, b, sizeof(Number) * static_cast<std::size_t>(count)) == 0;
}

// Not by their bytes, because they have padding.
bool same_contact(const mjContact& a, const mjContact& b) {
  return a.dist == b.dist && same_bits(a.pos, b.pos, 3) && same_bits(a.frame, b.frame, 9) &&
         same_bits(a.friction, b.friction, 5) && a.mu == b.mu && a.geom1 == b.geom1 && a.geom2 == b.geom2 &&
         a.efc_address == b.efc_address;
}

}  // namespace

extern "C" DOPPEL_API bool doppel_mujoco_same_contacts(const doppel::Engine& engine, bool rules_of_world) {
  const auto& at = static_cast<const doppel::MujocoEngine&>(engine);
  const mjModel* const m = at.m();
  const doppel::DataHandle own = doppel::make_data(m), ruled = doppel::make_data(m);
  doppel::copy_data(m, own.get(), at.d());
  doppel::copy_data(m, ruled.get(), at.d());
  mj_step1(m, own.get());
  const doppel::MujocoWorld& world = at.compiled_world();
  const doppel::ContactRules none;
  const doppel::ContactRules& rules = rules_of_world ? world.contact_rules : none;
  doppel::IslandSolver islands(*m, world.islands, rules);
  doppel::compute_contacts_and_constraints(m, ruled.get(), rules,
                                           rules_of_world ? world.bounces : doppel::Bounces{}, islands);
  // The rules change the references of sliding contacts while they are solved.
  at.write_present_efforts(*ruled);
  mj_fwdAcceleration(m, ruled.get());
  islands.solve(*m, *ruled);
  const mjData &a = *own, &b = *ruled;
  return a.ncon == b.ncon && a.nefc == b.nefc &&
         std::equal(a.contact, a.contact + a.ncon, b.contact, same_contact) &&
         same_bits(a.efc_aref, b.efc_aref, a.nefc) && same_bits(a.efc_R, b.efc_R, a.nefc) &&
         same_bits(a.efc_D, b.efc_D, a.nefc) && same_bits(a.efc_vel, b.efc_vel, a.nefc) &&
         same_bits(a.qM, b.qM, m->nM) && same_bits(a.qLD, b.qLD, m->nM) &&
         same_bits(a.qfrc_bias, b.qfrc_bias, m->nv) && same_bits(a.qfrc_passive, b.qfrc_passive, m->nv) &&
         same_bits(a.cvel, b.cvel, 6 * m->nbody) && same_bits(a.xpos, b.xpos, 3 * m->nbody);
}

extern "C" DOPPEL_API double doppel_mujoco_island_difference(const doppel::Engine& engine) {
  const auto& at = static_cast<const doppel::MujocoEngine&>(engine);
  const mjModel* const m = at.m();
  const doppel::DataHandle whole = doppel::make_data(m), divided = doppel::make_data(m);
  const doppel::ContactRules none;
  doppel::IslandSolver islands(*m, at.compiled_world().islands, none);
  for (mjData* const data : {whole.get(), divided.get()}) {
    doppel::copy_data(m, data, at.d());
    at.write_present_efforts(*data);
    mj_fwdAcceleration(m, data);
  }
  mj_fwdConstraint(m, whole.get());
  islands.solve(*m, *divided);
  double difference = 0.0, largest = 1e-9;
  for (int v = 0; v < m->nv; ++v) {
    difference = std::max(difference, std::abs(whole->qacc[v] - divided->qacc[v]));
    largest = std::max(largest, std::abs(whole->qacc[v]));
  }
  return difference / largest;
}

extern "C" DOPPEL_API bool doppel_mujoco_error_unwinds(const doppel::Engine& engine) {
  const auto& state = static_cast<const doppel::MujocoEngine&>(engine);
  const doppel::DataHandle copy = doppel::make_data(state.m());
  // Destroyed only if the error unwinds the frame that holds it.
  struct Flag {
    explicit Flag(bool& flag) : flag_(flag) {}
    Flag(const Flag&) = delete;
    Flag& operator=(const Flag&) = delete;
    ~Flag() { flag_ = true; }

   private:
    bool& flag_;
  };
  bool unwound = false;
  const bool whole = doppel::guarded([&copy, &unwound] {
    const Flag in_frame(unwound);
    mj_stackAlloc(copy.get(), copy->nstack + 1);
  });
  return !whole && unwound;
}

extern "C" DOPPEL_API double doppel_mujoco_bare_step_rate(const doppel::Engine& engine, int steps) {
  const auto& state = static_cast<const doppel::MujocoEngine&>(engine);
  const doppel::DataHandle copy = doppel::make_data(state.m());
  doppel::copy_data(state.m(), copy.get(), state.d());
  const auto start = std::chrono::steady_clock::now();
  for (int i = 0; i < steps; ++i) {
    state.write_present_efforts(*copy);
    mj_step(state.m(), copy.get());
  }
  const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
  return steps / taken.count();
}

extern "C" DOPPEL_API void doppel_mujoco_inverse_dynamics(const doppel::Engine& engine,
                                                          const double* acceleration, double* tau) {
  const auto& state = static_cast<const doppel::MujocoEngine&>(engine);
  const doppel::DataHandle copy = doppel::make_data(state.m());
  doppel::copy_data(state.m(), copy.get(), state.d());
  std::copy_n(acceleration, state.m()->nv, copy->qacc);
  mj_inverse(state.m(), copy.get());
  for (int v = 0; v < state.m()->nv; ++v)
    tau[v] =
        copy->qfrc_inverse[v] - state.m()->dof_armature[v] * copy->qacc[v] + state.joint_damping_effort(v);
}
