// The whole arm from its meshes, at joint angles q (rad), with the joint origins and axes of urdf/arm.urdf.xacro.
q = [0, 0, 0, 0];  // the start pose; the lab's test command is [1, 1, 1, 1]

graphite = [0.17, 0.18, 0.20];
red = [0.72, 0.07, 0.10];
aluminium = [0.74, 0.76, 0.79];
servo = [0.11, 0.11, 0.13];
horn = [0.45, 0.46, 0.48];

module mesh(name, c, xyz, rpy) { translate(1000 * xyz) rotate(rpy * 180 / PI) color(c) import(str("../meshes/", name, ".stl")); }
module joint(xyz, axis, angle) { translate(1000 * xyz) rotate(angle * 180 / PI, axis) children(); }

mesh("base_link", graphite, [0.0, 0.0, 0.0], [0, 0, 0]);
mesh("ax12_body", servo, [0.0, 0.0, 0.05], [0, 0, 0]);
joint([0.0, 0.0, 0.045], [0, 0, 1], 0) {
  mesh("base_2", red, [0.0, 0.0, 0.0], [0, 0, 0]);
  joint([0.0, 0.0, 0.005], [0, 0, 1], q[0]) {
    mesh("base_turn", graphite, [0.0, 0.0, 0.0], [0, 0, 0]);
    mesh("ax12_horn", horn, [0.0, 0.0, 0.0], [0, 0, 0]);
    joint([0.0, 0.0, 0.055], [0, 0, 1], 0) {
      mesh("ax12_body", servo, [0.0, 0.0205, 0.0], [0, -1.570796, -1.570796]);
      joint([0.0, 0.0, 0.0], [0, 1, 0], q[1]) {
        mesh("ax12_horn", horn, [0.0, 0.0205, 0.0], [0, -1.570796, -1.570796]);
        joint([0.0, 0.0, 0.0], [0, 0, 1], 0) {
          mesh("f4", red, [0.0, 0.0, 0.0], [0, 0, 0]);
          mesh("frame_u", aluminium, [0.0, 0.0, 0.0], [0, 0, 0]);
          joint([0.0, 0.0, 0.135], [0, 0, 1], 0) {
            mesh("ax12_body", servo, [0.0, 0.0205, 0.0], [0, -1.570796, -1.570796]);
            joint([0.0, 0.0, 0.0], [0, 1, 0], q[2]) {
              mesh("ax12_horn", horn, [0.0, 0.0205, 0.0], [0, -1.570796, -1.570796]);
              joint([0.0, 0.0, 0.0], [0, 0, 1], 0) {
                mesh("f5", red, [0.0, 0.0, 0.0], [0, 0, 0]);
                mesh("frame_u", aluminium, [0.0, 0.0, 0.0], [0, 0, 0]);
                joint([0.0, 0.0, 0.08], [0, 0, 1], 0) {
                  mesh("ax12_body", servo, [0.0, 0.0205, 0.0], [0, -1.570796, -1.570796]);
                  joint([0.0, 0.0, 0.0], [0, 1, 0], q[3]) {
                    mesh("ax12_horn", horn, [0.0, 0.0205, 0.0], [0, -1.570796, -1.570796]);
                    joint([0.0, 0.0, 0.0], [0, 0, 1], 0) {
                      mesh("wrist", red, [0.0, 0.0, 0.0], [0, 0, 0]);
                      mesh("frame_u", aluminium, [0.0, 0.0, 0.0], [0, 0, 0]);
                      joint([0.0, 0.0, 0.07], [0, 0, 1], 0) {
                        mesh("ax12_body", servo, [0.0, 0.0, 0.0], [0, 0, 0]);
                        joint([0.0, 0.0, 0.0], [0, 0, 1], 0) {
                          mesh("ax12_horn", horn, [0.0, 0.0, 0.0], [0, 0, 0]);
                          joint([0.0, 0.0, 0.0], [0, 0, 1], 0) {
                            mesh("crawer_base", graphite, [0.0, 0.0, 0.0], [0, 0, 0]);
                            joint([0.0, 0.018, 0.01], [0, 0, 1], 0) {
                              mesh("crawer_left", red, [0.0, 0.0, 0.0], [0, 0, 0]);
                            }
                            joint([0.0, -0.018, 0.01], [0, 0, 1], 0) {
                              mesh("crawer_right", red, [0.0, 0.0, 0.0], [0, 0, 0]);
                            }
                          }
                        }
                      }
                    }
                  }
                }
              }
            }
          }
        }
      }
    }
  }
}
translate([0, 66, 40]) color(red) cube([30, 20, 20], center = true);
