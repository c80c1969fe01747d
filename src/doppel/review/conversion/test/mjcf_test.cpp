#include <mujoco/mujoco.h>

#include "conversion_fixture.h"
#include "doppel/base/core/output_file.h"
#include "doppel/review/conversion/mjcf_export.h"
#include "doppel/robot/kinematics/dynamics.h"

namespace doppel {
namespace {

struct Loaded {
  mjModel* model = nullptr;
  mjData* data = nullptr;
  std::string problem;
  Loaded(const std::filesystem::path& file) {
    char error[1000] = "";
    model = mj_loadXML(file.c_str(), nullptr, error, sizeof error);
    problem = error;
    if (model != nullptr) data = mj_makeData(model);
  }
  Loaded(const Loaded&) = delete;
  ~Loaded() {
    if (data != nullptr) mj_deleteData(data);
    if (model != nullptr) mj_deleteModel(model);
  }
};

std::filesystem::path exported(const Converted& converted, const std::string& folder_name) {
  const auto folder = fresh_folder(folder_name);
  MeshFiles files({folder, false, "meshes"});
  Diagnostics diagnostics;
  const std::string text = to_mjcf(converted.robot, converted.model, files, diagnostics);
  files.write();
  write_whole(folder / "robot.xml", text);
  return folder / "robot.xml";
}

// Every joint by name, because MuJoCo chooses the order.
void set_q(const Model& model, const Eigen::VectorXd& q, const Loaded& loaded) {
  for (const ModelJoint& joint : model.joints) {
    if (!joint.scalar()) continue;
    const int id = mj_name2id(loaded.model, mjOBJ_JOINT, joint.name.c_str());
    ASSERT_GE(id, 0) << joint.name;
    loaded.data->qpos[loaded.model->jnt_qposadr[id]] = q[joint.q];
  }
}

Pose body_pose(const Loaded& loaded, const std::string& name) {
  const int id = mj_name2id(loaded.model, mjOBJ_BODY, name.c_str());
  EXPECT_GE(id, 0) << name;
  const mjtNum* p = loaded.data->xpos + 3 * id;
  const mjtNum* R = loaded.data->xmat + 9 * id;
  Pose X;
  X.translation() << p[0], p[1], p[2];
  X.linear() << R[0], R[1], R[2], R[3], R[4], R[5], R[6], R[7], R[8];
  X.makeAffine();
  return X;
}

void expect_equal(const Converted& converted, const Loaded& loaded) {
  const Model& model = converted.model;
  SCOPED_TRACE("seed 7");
  std::mt19937 generator(7);
  EXPECT_NEAR(mj_getTotalmass(loaded.model), model.total_mass, 1e-9 * model.total_mass);
  Data data(model);
  for (int trial = 0; trial < 50; ++trial) {
    const Eigen::VectorXd q = random_q(model, generator);
    set_q(model, q, loaded);
    mj_forward(loaded.model, loaded.data);
    forward_kinematics(model, data, q);
    gravity_torques(model, data, q, {0, 0, -9.81});
    for (std::size_t i = 0; i < model.links.size(); ++i)
      ASSERT_TRUE(same(body_pose(loaded, model.links[i].name), data.X_WL[i], 1e-9)) << model.links[i].name;
    for (const ModelJoint& joint : model.joints) {
      if (!joint.scalar()) continue;
      const int id = mj_name2id(loaded.model, mjOBJ_JOINT, joint.name.c_str());
      ASSERT_NEAR(loaded.data->qfrc_bias[loaded.model->jnt_dofadr[id]], data.tau[joint.v], 1e-9)
          << joint.name;
    }
  }
}

class BundledMjcfTest : public testing::TestWithParam<std::string> {};

TEST_P(BundledMjcfTest, MujocoReadsSameRobot) {
  const Converted converted = bundled(GetParam());
  const Loaded loaded(exported(converted, "mjcf_" + GetParam()));
  ASSERT_NE(loaded.model, nullptr) << loaded.problem;
  expect_equal(converted, loaded);
  EXPECT_EQ(static_cast<std::size_t>(loaded.model->nu), converted.model.driven_joint_names().size());
}

INSTANTIATE_TEST_SUITE_P(Robots, BundledMjcfTest, testing::Values("omarm_one", "omarm_zero", "lab_arm"));

TEST(MjcfTest, EveryElementIsConverted) {
  const Converted converted = from_text(kWholeRobot);
  const Loaded loaded(exported(converted, "mjcf_whole"));
  ASSERT_NE(loaded.model, nullptr) << loaded.problem;
  expect_equal(converted, loaded);
  const mjModel* m = loaded.model;
  const int twist = mj_name2id(m, mjOBJ_JOINT, "turn & \"twist\"");
  ASSERT_GE(twist, 0) << "expected names to be preserved";
  EXPECT_EQ(m->jnt_range[2 * twist], -1);
  EXPECT_EQ(m->jnt_range[2 * twist + 1], 2);
  EXPECT_EQ(m->dof_damping[m->jnt_dofadr[twist]], 0.1);
  EXPECT_EQ(m->dof_frictionloss[m->jnt_dofadr[twist]], 0.02);
  // The constraints are those of the twin's own model at 1 ms.
  EXPECT_EQ(m->dof_solref[2 * m->jnt_dofadr[twist]], 0.002);
  EXPECT_EQ(m->dof_solimp[5 * m->jnt_dofadr[twist]], 0.9999);
  EXPECT_EQ(m->jnt_solref[2 * twist], 0.005);
  EXPECT_EQ(m->jnt_solimp[5 * twist], 0.95);
  EXPECT_FALSE(m->jnt_limited[mj_name2id(m, mjOBJ_JOINT, "wheel")]);
  const int drive = mj_name2id(m, mjOBJ_ACTUATOR, "turn & \"twist\"");
  ASSERT_GE(drive, 0);
  EXPECT_EQ(m->actuator_forcerange[2 * drive], -5);
  EXPECT_EQ(m->actuator_forcerange[2 * drive + 1], 5);
  EXPECT_EQ(m->nu, 3) << "expected no drive for the mimic joint";
  ASSERT_EQ(m->neq, 1);
  EXPECT_EQ(m->eq_data[0], 0.01);
  EXPECT_EQ(m->eq_data[1], 1.5);
  EXPECT_EQ(m->nexclude, 1) << "expected one exclusion: base and upper";
}

TEST(MjcfTest, OverlapAtStartIsExcluded) {
  const auto link = [](const std::string& name) {
    return "<link name=\"" + name +
           "\"><inertial><mass value=\"1\"/><inertia ixx=\"0.01\" ixy=\"0\" ixz=\"0\" "
           "iyy=\"0.01\" iyz=\"0\" izz=\"0.01\"/></inertial><collision><geometry><sphere radius=\"0.12\"/>"
           "</geometry></collision></link>";
  };
  const auto joint = [](const std::string& parent, const std::string& child) {
    return "<joint name=\"" + child + "_joint\" type=\"continuous\"><parent link=\"" + parent +
           "\"/><child link=\"" + child + "\"/><origin xyz=\"0.1 0 0\"/></joint>";
  };
  const Converted converted = from_text("<robot name=\"r\">" + link("a") + link("b") + link("c") + link("d") +
                                        joint("a", "b") + joint("b", "c") + joint("c", "d") + "</robot>");
  const Loaded loaded(exported(converted, "mjcf_overlap"));
  ASSERT_NE(loaded.model, nullptr) << loaded.problem;
  EXPECT_EQ(loaded.model->nexclude, 5)
      << "expected three neighbours, a and c, b and d; a and d are 0.06 m apart";
  mj_forward(loaded.model, loaded.data);
  EXPECT_EQ(loaded.data->ncon, 0);
}

TEST(MjcfTest, ServosHoldRobotWithPredictedSag) {
  const Converted converted = bundled("omarm_one");
  const Loaded loaded(exported(converted, "mjcf_hold"));
  ASSERT_NE(loaded.model, nullptr) << loaded.problem;
  const Model& model = converted.model;
  const Eigen::VectorXd q = model.neutral();
  set_q(model, q, loaded);
  for (int i = 0; i < loaded.model->nu; ++i) {
    const int joint = loaded.model->actuator_trnid[2 * i];
    loaded.data->ctrl[i] = loaded.data->qpos[loaded.model->jnt_qposadr[joint]];
  }
  for (int step = 0; step < 3000; ++step) mj_step(loaded.model, loaded.data);
  for (const ModelJoint& joint : model.joints) {
    if (!joint.scalar() || joint.mimics()) continue;
    const int id = mj_name2id(loaded.model, mjOBJ_JOINT, joint.name.c_str());
    EXPECT_NEAR(loaded.data->qpos[loaded.model->jnt_qposadr[id]], q[joint.q], 0.006) << joint.name;
  }
}

TEST(MjcfTest, UnreadableMeshesAreConverted) {
  const auto folder = fresh_folder("mjcf_text_stl");
  std::ofstream(folder / "part.stl")
      << "solid s\nfacet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 0 1 0\nvertex 1 0 "
         "0\nendloop\nendfacet\n"
         "facet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 0 1\nendloop\nendfacet\n"
         "facet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 0 0 1\nvertex 0 1 0\nendloop\nendfacet\n"
         "facet normal 0 0 0\nouter loop\nvertex 1 0 0\nvertex 0 1 0\nvertex 0 0 1\nendloop\nendfacet\n"
         "endsolid s\n";
  const Converted converted = from_text(
      "<robot name=\"r\"><link name=\"a\"><inertial><mass value=\"1\"/><inertia ixx=\"1\" ixy=\"0\" "
      "ixz=\"0\" "
      "iyy=\"1\" iyz=\"0\" izz=\"1\"/></inertial><visual><geometry><mesh filename=\"file://" +
      (folder / "part.stl").string() + "\" scale=\"0.1 0.1 0.1\"/></geometry></visual></link></robot>");
  MeshFiles files({folder, false, std::nullopt});
  Diagnostics diagnostics;
  write_whole(folder / "robot.xml", to_mjcf(converted.robot, converted.model, files, diagnostics));
  files.write();
  EXPECT_TRUE(std::filesystem::exists(folder / "meshes" / "part.obj"));
  const Loaded loaded(folder / "robot.xml");
  ASSERT_NE(loaded.model, nullptr) << loaded.problem;
  EXPECT_EQ(loaded.model->nmesh, 1);
}

}  // namespace
}  // namespace doppel
