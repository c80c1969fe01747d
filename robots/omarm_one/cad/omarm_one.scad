// OmArm One, printed parts. Millimetres, assembly frame: base_link's frame, x to the side, y forward, z up, in the pose
// in which the arm was exported from CAD. `part` picks what is built; robots/build_meshes asks for each in turn.
//
// From the shoulder on, everything is drawn upright ("arm frame": origin on the shoulder axis, upper arm along z,
// forearm along y) and then leaned back by 10 degrees, which is where the axes 0 0.984808 0.173648 come from.
use <../../cad_library/servos.scad>
use <../../cad_library/shapes.scad>

part = "";
$fn = 24;

turntable_z = 42.57;   // Revolute 1
shoulder = [-30.63, 0, 91.57];
lean = 10;
elbow_z = 150;         // along the upper arm
roll_y = 76;           // along the forearm: Revolute 4,
wrist_y = 128;         // 5,
tool_y = 198;          // 6,
palm_y = 206;          // Rigid 7,
gear_y = 234;          // 8 and 9
gear_x = 12;
finger_y = 258;        // where a finger is screwed to its gear
wrist_x = -26;         // outer face of the wrist servo's horn

module leaned() { translate([0, 0, shoulder.z]) rotate([lean, 0, 0]) children(); }

// --- base -----------------------------------------------------------------------------------------------------------
module base_link() {
  difference() {
    union() {
      difference() {                                   // foot plate with four arms
        slab(8, 1) hull() ring_of(4, 60, 45) circle(15, $fn = 12);
        for (a = [0:90:270]) rotate(a) translate([76, 0, -1]) cylinder(r = 31, h = 10, $fn = 18);
      }
      hull() {                                         // drum
        translate([0, 0, 7]) linear_extrude(1) circle(48);
        translate([0, 0, 35]) linear_extrude(1) circle(44);
      }
      translate([0, 0, 35.9]) cylinder(r1 = 44, r2 = 42, h = 6);
      hull() {                                         // electronics box behind
        translate([0, -54, 3]) linear_extrude(24) rounded([56, 32], 6, $fn = 12);
        translate([0, -42, 3]) linear_extrude(32) rounded([50, 22], 5, $fn = 12);
      }
    }
    translate([-10, 0, 2.9]) linear_extrude(60) square([41, 21], center = true);   // servo
    translate([-10, 0, 30]) linear_extrude(30) square([56, 21], center = true);  // its ears
    translate([25, 0, 9]) linear_extrude(60) rounded([13, 44], 4, $fn = 4);        // cables
    for (s = [-1, 1]) translate([-10, 24 * s, 20]) linear_extrude(60) rounded([40, 11], 4, $fn = 4);
    translate([0, -76, 14]) rotate([-90, 0, 0]) linear_extrude(12) rounded([13, 7], 2, $fn = 4);  // USB
    for (x = [-12:12:12]) translate([x, -54, 22]) linear_extrude(20) square([3, 16], center = true);  // vents
    translate([0, -54, 6]) linear_extrude(16) square([46, 22], center = true);     // room for the boards
    translate([0, 0, -1]) linear_extrude(4) ballast_profile(0.4);
    for (a = [45:90:315]) rotate(a) translate([63, 0, -1]) {
      cylinder(d = 5, h = 12, $fn = 10);
      translate([0, 0, 6]) cylinder(d = 9.5, h = 10, $fn = 12);
    }
  }
}
module ballast_profile(play = 0) {  // a steel plate let into the foot
  offset(delta = play) difference() { rounded([76, 76], 12, $fn = 12); circle(12, $fn = 12); }
}
module base_ballast() { linear_extrude(3) ballast_profile(); }
module base_electronics() { translate([0, -54, 7]) linear_extrude(13) square([44, 20], center = true); }  // driver, regulator, wires

// --- turret: turntable with two cheeks -----------------------------------------------------------------------------
module cheek_profile() {   // in y, z of the assembly
  difference() {
    hull() {
      translate([0, shoulder.z]) circle(19);
      translate([-34, 51]) square([68, 2]);
    }
    for (s = [-1, 1]) hull() {
      translate([17 * s, 59]) circle(4, $fn = 8);
      translate([10 * s, 71]) circle(3, $fn = 8);
    }
    hull() { translate([0, 57.5]) circle(3.5, $fn = 8); translate([0, 66]) circle(3, $fn = 8); }
  }
}
module base_upper() {
  difference() {
    union() {
      translate([0, 0, turntable_z + 0.6]) slab(10.4, 1.2) circle(47);
      along_x(-40, -30.63) cheek_profile();
      along_x(21.5, 31) cheek_profile();
      translate([15.6, 0, shoulder.z]) rotate([0, 90, 0]) cylinder(d1 = 11, d2 = 16, h = 7, $fn = 12);   // idler's journal
      translate([30.9, 0, shoulder.z]) rotate([0, 90, 0]) cylinder(d = 22, h = 2.3, $fn = 16);          // bearing's cap
      for (s = [-1, 1]) translate([0, s * 23, 52]) rotate([90, 0, 0])                                 // gussets
        linear_extrude(6, center = true) polygon([[-31, 0], [-31, 15], [-22, 0]]);
      for (s = [-1, 1]) translate([0, s * 23, 52]) rotate([90, 0, 0])
        linear_extrude(6, center = true) polygon([[14, 0], [22, 13], [22, 0]]);
    }
    translate([0, 0, turntable_z - 1]) cylinder(d = 24, h = 7.9, $fn = 12);                            // horn of Revolute 1
    for (a = [45:90:315]) rotate(a) translate([7, 0, 40]) cylinder(d = 3.2, h = 20, $fn = 4);
    for (a = [0:60:300]) rotate(a) translate([40, 0, 51]) cylinder(d = 5, h = 5, $fn = 6);
    translate([-45, 0, shoulder.z]) rotate([0, 90, 0]) {
      cylinder(d = 9, h = 20, $fn = 12);
      for (a = [45:90:315]) rotate(a) translate([7, 0, 0]) cylinder(d = 3.2, h = 20, $fn = 4);
    }
  }
}

// --- upper arm -------------------------------------------------------------------------------------------------------
module upper_arm_profile(r = 24) {  // in y, z of the arm frame
  hull() {
    circle(r);
    translate([0, elbow_z]) circle(r - 0.5);
  }
}
module upper_arm_windows($fn = 6) {
  hull() { for (s = [-1, 1]) translate([9 * s, 53]) circle(4); translate([0, 64]) circle(3); }
  hull() { for (s = [-1, 1]) translate([9 * s, 97]) circle(4); translate([0, 86]) circle(3); }
  for (s = [-1, 1]) hull() { for (z = [70, 80]) translate([13 * s, z]) circle(3.5); translate([6.5 * s, 75]) circle(2); }
}
module link_1() {
  difference() {
    union() {
      slab_x(-22.4, -13.8, 1.2) upper_arm_profile();      // plate that the servos' ears are screwed to
      slab_x(10.4, 20.2, 1.2) upper_arm_profile();          // plate on the bearings' side
      along_x(-14, 11) {                                    // webs between the plates
        for (z = [39.5, 102.5]) translate([-19, z]) square([38, 8]);
        translate([-5, 47]) square([10, 56]);
      }
      along_x(-14, 11) for (s = [-1, 1]) translate([20.5 * s, 75]) square([5, 36], center = true);   // skins
      along_x(-14, 11) intersection() {                     // round both ends
        difference() { upper_arm_profile(); upper_arm_profile(20); }
        union() { translate([-30, -30]) square([60, 25]); translate([-30, elbow_z + 5]) square([60, 25]); }
      }
    }
    along_x(-40, 40) upper_arm_windows();
    translate([-1.5, 0, 75]) along_y(-40, 40) rounded([14, 22], 4, $fn = 4);
    along_x(-40, -12) for (z = [-10.4, elbow_z - 30.6]) translate([-10.4, z]) square([20.8, 41]);  // gear cases
    along_x(9, 15.8) for (z = [-10.4, elbow_z - 30.6]) translate([-10.4, z]) square([20.8, 41]);   // bottoms
    along_x(15, 40) for (z = [0, elbow_z]) translate([0, z]) circle(d = 11.4, $fn = 16);
    along_x(-40, -10) for (z = [-14, 34.5, elbow_z - 34.5, elbow_z + 14], y = [-5, 5])
      translate([y, z]) circle(d = 3, $fn = 4);
  }
}

// --- elbow: a yoke that carries the forearm's servo ------------------------------------------------------------------
module yoke_cheek(r, back, front, half = 13) {  // in y, z; round the axis at 0, reaching forward to `front`
  hull() {
    circle(r);
    translate([back, -half]) square([front - back, 2 * half]);
  }
}
module link_2() {
  translate([0, 0, elbow_z]) difference() {
    union() {
      slab_x(-39.6, -30.63, 1) yoke_cheek(17, 26, 62, 15);
      slab_x(20.6, 29.6, 1) yoke_cheek(17, 26, 62, 15);
      translate([14, 0, 0]) rotate([0, 90, 0]) cylinder(d1 = 10, d2 = 15, h = 7, $fn = 16);
      translate([29.5, 0, 0]) rotate([0, 90, 0]) cylinder(d = 20, h = 2, $fn = 20);
      slab_y(26, 30.2, 1) translate([-5, 0]) square([65, 30], center = true);       // bridge
      slab_y(52, 62, 1) translate([-5, 0]) square([69, 30], center = true);         // frame in front of the ears
    }
    along_y(50, 66) translate([-10, 0]) square([41, 20.6], center = true);
    along_y(50, 66) for (x = [-34.5, 14.5], z = [-5, 5]) translate([x, z]) circle(d = 3, $fn = 6);
    along_y(20, 34) for (x = [-18, 0]) translate([x, 0]) rounded([12, 16], 4, $fn = 8);
    along_x(-50, 50) hull() { translate([24, 0]) circle(5.5, $fn = 12); translate([42, 0]) circle(5.5, $fn = 12); }
    translate([-42, 0, 0]) rotate([0, 90, 0]) {
      cylinder(d = 9, h = 12, $fn = 12);
      for (a = [45:90:315]) rotate(a) translate([7, 0, 0]) cylinder(d = 3.2, h = 12, $fn = 6);
    }
  }
}

// --- forearm: turns about its own length, carries the wrist's servo ---------------------------------------------------
module link_3() {
  translate([0, roll_y, elbow_z]) difference() {
    union() {
      slab_y(0.2, 7, 1) circle(21);
      hull() {
        along_y(6, 7) circle(19);
        along_y(13, 14.5) translate([7, 0]) square([33, 32], center = true);
      }
      slab_x(-9, -3, 0.8) translate([39, 0]) rounded([57, 32], 7);     // plate behind the ears
      slab_x(15.5, 23.4, 0.8) translate([39, 0]) rounded([57, 32], 7);
      along_x(-5, 18) translate([13, -16]) square([6, 32]);
      along_x(-5, 18) for (z = [-15.5, 11]) translate([34, z]) square([14, 4.5]);   // ribs over the servo
    }
    along_x(-16, 18) translate([20.8, -10.4]) square([42, 20.8]);
    along_x(-14, 30) translate([52, 0]) circle(d = 9, $fn = 16);
    along_x(15, 30) hull() { translate([25, 0]) circle(5, $fn = 10); translate([38, 0]) circle(5, $fn = 10); }
    along_x(-14, 0) for (y = [17.5, 66.3], z = [-5, 5]) translate([y, z]) circle(d = 3, $fn = 6);
    along_y(-1, 12) { circle(d = 8, $fn = 12); for (a = [0:90:270]) rotate(a) translate([7, 0]) circle(d = 3.2, $fn = 6); }
  }
}

// --- wrist: a yoke that carries the tool's servo ------------------------------------------------------------------------
module link_4() {
  translate([0, wrist_y, elbow_z]) difference() {
    union() {
      slab_x(wrist_x - 8.4, wrist_x, 1) yoke_cheek(15, 20, 56, 14);
      slab_x(25, 33.4, 1) yoke_cheek(15, 20, 56, 14);
      translate([19.5, 0, 0]) rotate([0, 90, 0]) cylinder(d1 = 8.6, d2 = 13, h = 6, $fn = 16);
      translate([33.3, 0, 0]) rotate([0, 90, 0]) cylinder(d = 18, h = 1.8, $fn = 18);
      slab_y(20, 24, 0.8) translate([-0.5, 0]) square([63, 28], center = true);
      slab_y(47, 55.4, 0.8) translate([-0.5, 0]) square([67, 28], center = true);
    }
    along_y(45, 60) translate([-10, 0]) square([41, 20.6], center = true);
    along_y(45, 60) for (x = [-34.5, 14.5], z = [-5, 5]) translate([x, z]) circle(d = 3, $fn = 6);
    along_y(18, 26) for (x = [-16, 0, 16]) translate([x, 0]) rounded([11, 14], 4, $fn = 8);
    along_x(-50, 50) hull() { translate([22, 0]) circle(5, $fn = 12); translate([38, 0]) circle(5, $fn = 12); }
    translate([wrist_x - 10, 0, 0]) rotate([0, 90, 0]) {
      cylinder(d = 9, h = 12, $fn = 12);
      for (a = [45:90:315]) rotate(a) translate([7, 0, 0]) cylinder(d = 3.2, h = 12, $fn = 6);
    }
  }
}

module tool_link() {
  translate([0, tool_y, elbow_z]) difference() {
    union() {
      slab_y(0.2, 5, 0.8) circle(17);
      slab_y(4.5, 8, 0.8) rounded([30, 22], 6);
    }
    along_y(-1, 3) circle(d = 6);
    along_y(-1, 12) for (a = [0:90:270]) rotate(a) translate([7, 0]) circle(d = 3.2, $fn = 6);
  }
}

// --- gripper -------------------------------------------------------------------------------------------------------------
module palm_profile() {  // in x, y around the gears' centre line
  filleted(5) {
    translate([-17, -28]) square([34, 6]);
    hull() { for (s = [-1, 1]) translate([s * gear_x, 0]) circle(11); translate([-13, -27]) square([26, 2]); }
  }
}
module gripper_base() {
  translate([0, gear_y, elbow_z]) difference() {
    union() {
      translate([0, 0, -5.4]) linear_extrude(5) palm_profile();
      for (s = [-1, 1]) translate([s * 19.6, -16, -9]) rotate([90, 0, 90]) slab(3, 0.5) rounded([24, 10], 3, $fn = 8);  // rails
      translate([0, -25.9, -2]) rotate([90, 0, 0]) slab(2.1, 0.5) rounded([36, 26], 6, $fn = 16);
      for (s = [-1, 1]) translate([s * 13, -26, -5]) rotate([90, 0, 90])
        linear_extrude(3.4, center = true) polygon([[0, 0], [13, 0], [0, -8]]);
      translate([gear_x, 0, -0.6]) cylinder(d = 4.9, h = 8.4, $fn = 20);             // right gear's pin
      translate([gear_x, 0, -0.6]) cylinder(d = 8, h = 1, $fn = 16);
    }
    translate([-gear_x, -5.5, -10]) linear_extrude(20) square([12.6, 23.2], center = true);
    translate([-gear_x, -5.5, -10]) for (s = [-1, 1]) translate([0, 14 * s, 0]) cylinder(d = 1.8, h = 20, $fn = 8);
    translate([gear_x, -11, -10]) linear_extrude(20) rounded([10, 8], 3);
  }
}

module tooth(r) { polygon([[r - 2, -1.75], [r + 1, -0.7], [r + 1, 0.7], [r - 2, 1.75]]); }
module gear_profile(shift) {  // pitch radius 12, 20 teeth; teeth only where the two gears meet and where they may look at
  union() {
    circle(10.6);
    for (i = [0:19]) rotate(18 * i + shift) tooth(11.8);
    hull() { translate([0, 6]) circle(8.5); translate([0, finger_y - gear_y]) circle(7.5); }
  }
}
module gear(side) {  // side -1: left, +1: right
  translate([side * gear_x, gear_y, elbow_z]) difference() {
    translate([0, 0, 0.6]) linear_extrude(6) gear_profile(side < 0 ? 0 : 9);
    translate([0, 0, -1]) cylinder(d = side < 0 ? 4.6 : 5.3, h = 10, $fn = 20);
    if (side < 0) cylinder(d = 12.4, h = 3.1);                                       // the servo's boss
    for (y = [14, finger_y - gear_y]) translate([0, y, -1]) cylinder(d = 3, h = 10, $fn = 12);
  }
}
module finger_profile(side) {  // in x, y from the gear's axis, the other finger towards -side
  inner = -side * (gear_x - 0.6);
  difference() {
    hull() {
      translate([0, finger_y - gear_y - 13]) circle(5);
      translate([side * 2, 46]) circle(6);
      translate([inner + side * 3, 84]) circle(2.6);
      translate([inner + side * 0.02, 47]) square([0.01, 37], center = false);
    }
    for (y = [50:4:82]) translate([inner, y]) rotate(45) square(1.7, center = true);
    hull() { translate([side * 0, 46]) circle(2.6); translate([inner * 0.45, 64]) circle(1.6); }
  }
}
module finger(side) {
  translate([side * gear_x, gear_y, elbow_z]) difference() {
    translate([0, 0, 6.7]) union() {
      linear_extrude(4.6) hull() {
        translate([0, finger_y - gear_y - 13]) circle(5);
        translate([0, 40]) circle(6);
      }
      translate([0, 0, -9]) linear_extrude(13.6) intersection() {
        finger_profile(side);
        translate([-30, 34]) square([60, 60]);
      }
    }
    for (y = [14, finger_y - gear_y]) translate([0, y, 0]) cylinder(d = 3, h = 20, $fn = 12);
  }
}

if (part == "base_link") base_link();
if (part == "base_ballast") base_ballast();
if (part == "base_electronics") base_electronics();
if (part == "base_link_upper_1") base_upper();
if (part == "link_1_1") leaned() link_1();
if (part == "link_2_1") leaned() link_2();
if (part == "link_3_1") leaned() link_3();
if (part == "link_4_1") leaned() link_4();
if (part == "tool_link_1") leaned() tool_link();
if (part == "gripper_base_1") leaned() gripper_base();
if (part == "gripper_gear_left_1") leaned() gear(-1);
if (part == "gripper_gear_right_1") leaned() gear(1);
if (part == "gripper_finger_left_1") leaned() finger(-1);
if (part == "gripper_finger_right_1") leaned() finger(1);
if (part == "ds3240_body") { ds3240_body(); }
if (part == "ds3240_horn") ds3240_horn();
if (part == "sg90_body") sg90_body();
