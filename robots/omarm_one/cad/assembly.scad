// The whole arm from its meshes, at joint angles q (rad), with the joint origins and axes of urdf/omarm.xacro.
//   openscad -D 'q=[0,0,0,0,0,0,0]' omarm_one/cad/assembly.scad
q = [1.5708, 1.5708, 1.5708, 1.5708, 1.5708, 1.5708, 0.4];  // the start pose

graphite = [0.16, 0.17, 0.19];
orange = [0.93, 0.36, 0.08];
bone = [0.88, 0.87, 0.83];
servo = [0.11, 0.11, 0.13];
metal = [0.72, 0.74, 0.77];
blue = [0.10, 0.28, 0.60];

module mesh(name, c) { color(c) import(str("../meshes/", name, ".stl")); }
// One joint: its origin (m, rpy), its axis and its angle.
module joint(xyz, rpy, axis, angle) {
  translate(1000 * xyz) rotate(rpy * 180 / PI) rotate(angle * 180 / PI, axis) children();
}
module link(name, c, visual) { translate(1000 * visual) mesh(name, c); }
module body(xyz, rpy) { translate(1000 * xyz) rotate(rpy * 180 / PI) children(); }
h = PI / 2;
lean = 0.174533;

link("base_link", graphite, [0, 0, 0]);
mesh("base_ballast", metal);
mesh("base_electronics", blue);
body([0, 0, 0.0495], [0, 0, 0]) mesh("ds3240_body", servo);
joint([0, 0, 0.04257], [0, 0, -1.570796], [0, 0, 1], q[0]) {
  link("base_link_upper_1", bone, [0, 0, -0.04257]);
  joint([-0.03063, 0, 0.049], [-1.356194163, 0, 0], [1, 0, 0], q[1]) {
    link("link_1_1", orange, [0.03063, 0, -0.09157]);
    rotate(10, [1, 0, 0]) {
      rotate([0, 90, 180]) mesh("ds3240_body", servo);
      translate([0, 0, 150]) rotate([0, -90, 0]) mesh("ds3240_body", servo);
    }
    joint([0, -0.026047, 0.147721], [1.359931089, 0, 0], [-1, 0, 0], q[2]) {
      link("link_2_1", bone, [0.03063, 0.026047, -0.239291]);
      rotate(10, [1, 0, 0]) translate([30.63, 76, 0]) rotate([-90, 0, 0]) mesh("ds3240_body", servo);
      joint([0.03063, 0.074845, 0.013197], [0, 0, 0], [0, -0.984808, -0.173648], q[3]) {
        link("link_3_1", orange, [0, -0.048798, -0.252488]);
        rotate(10, [1, 0, 0]) translate([-26, 52, 0]) rotate([-90, 0, 90]) mesh("ds3240_body", servo);
        joint([-0.026, 0.05121, 0.00903], [1.570796, 0, 0], [-1, 0, 0], q[4]) {
          link("link_4_1", bone, [0.026, -0.100008, -0.261518]);
          rotate(10, [1, 0, 0]) translate([26, 70, 0]) rotate([-90, 0, 0]) mesh("ds3240_body", servo);
          joint([0.026, 0.068937, 0.012155], [0, 0, 0], [0, -0.984808, -0.173648], q[5]) {
            link("tool_link_1", metal, [0, -0.168945, -0.273673]);
            joint([0, 0.007878, 0.001389], [0, 0, 0], [1, 0, 0], 0) {
              link("gripper_base_1", graphite, [0, -0.176823, -0.275062]);
              rotate(10, [1, 0, 0]) translate([-12, 28, 3]) rotate(90) mesh("sg90_body", blue);
              joint([-0.012, 0.027575, 0.004862], [0, 0, 0], [0, -0.173648, 0.984808], q[6]) {
                link("gripper_gear_left_1", bone, [0.012, -0.204398, -0.279924]);
                link("gripper_finger_left_1", orange, [0.012, -0.204398, -0.279924]);
              }
              joint([0.012, 0.027575, 0.004862], [0, 0, 0], [0, 0.173648, -0.984808], q[6]) {
                link("gripper_gear_right_1", bone, [-0.012, -0.204398, -0.279924]);
                link("gripper_finger_right_1", orange, [-0.012, -0.204398, -0.279924]);
              }
            }
          }
        }
      }
    }
  }
}
