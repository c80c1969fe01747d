// The whole arm from its meshes, at joint angles q (rad), with the joint origins and axes of urdf/omarm_zero.xacro.
q = [0, -2.2, -2.4, -1.0, -1.5708, -0.3];  // the start pose, with an open gripper

graphite = [0.16, 0.17, 0.19];
white = [0.93, 0.93, 0.91];
teal = [0.02, 0.48, 0.50];
mg996r_body = [0.11, 0.11, 0.13];
mg996r_horn = [0.85, 0.68, 0.25];
mg90s_body = [0.12, 0.22, 0.50];

module mesh(name, c) { color(c) import(str("../meshes/", name, ".stl")); }
module joint(xyz, axis, angle) { translate(1000 * xyz) rotate(angle * 180 / PI, axis) children(); }
module link(name, c, visual) { translate(1000 * visual) mesh(name, c); }
module body(name, c, xyz, rpy) { translate(1000 * xyz) rotate(rpy * 180 / PI) mesh(name, c); }

link("base_link", graphite, [0.0, 0.0, 0.0]);
body("mg996r_body", mg996r_body, [0.0, 0.0, 0.057], [0, 0, 0]);
joint([0.0, 0.0, 0.05087], [0, 0, 1], q[0]) {
  link("base_link_upper_1", white, [0.0, 0.0, -0.05087]);
  body("mg996r_horn", mg996r_horn, [0.0, 0.0, 0.00613], [0, 0, 0]);
  body("mg996r_body", mg996r_body, [-0.00039, -0.024, 0.047], [0, -1.570796, 1.554468]);
  joint([-0.00039, -0.024, 0.047], [0.016327, 0.999867, 0.0], q[1]) {
    link("arm_link_1_1", teal, [0.00039, 0.024, -0.09787]);
    body("mg996r_horn", mg996r_horn, [0.0, 0.0, 0.0], [0, -1.570796, 1.554468]);
    body("mg996r_horn", mg996r_horn, [0.10498, -0.00171, 0.0], [0, -1.570796, 1.554468]);
    joint([0.10498, -0.00171, 0.0], [-0.016327, -0.999867, 0.0], q[2]) {
      link("arm_link_2_1", white, [-0.10459, 0.02571, -0.09787]);
      body("mg996r_body", mg996r_body, [0.0, 0.0, 0.0], [-1.570796, 0, 3.125265]);
      body("mg90s_body", mg90s_body, [0.08514, 0.00761, 0.0], [1.570796, 0, -0.016328]);
      joint([0.08514, 0.00761, 0.0], [-0.016327, -0.999867, 0.0], q[3]) {
        link("arm_link_3_1", teal, [-0.18973, 0.0181, -0.09787]);
        body("mg90s_body", mg90s_body, [0.00024, 0.015, 0.049], [0, 0, 1.554468]);
        joint([0.00024, 0.015, 0.049], [0.0, 0.0, 1.0], q[4]) {
          link("gripper_base_1", white, [-0.18997, 0.0031, -0.14687]);
          body("mg90s_body", mg90s_body, [-0.00891, 0.00514, 0.02], [0, -1.570796, -1.587124]);
          joint([-0.00899, 0.00014, 0.02], [0.016327, 0.999867, 0.0], q[5]) {
            link("gripper_left_1", teal, [-0.18098, 0.00296, -0.16687]);
          }
          joint([0.009, -0.00015, 0.02], [0.016327, 0.999867, 0.0], -q[5]) {
            link("gripper_right_1", teal, [-0.19897, 0.00325, -0.16687]);
          }
        }
      }
    }
  }
}
