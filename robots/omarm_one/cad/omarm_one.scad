// OmArm One, printed parts. Millimetres, assembly frame: base_link's frame, x to the side, y forward, z up, in the pose
// in which the arm was exported from CAD. `part` picks what is built; robots/build_meshes asks for each in turn.
//
// From the shoulder on, everything is drawn upright ("arm frame": origin on the shoulder axis, upper arm along z,
// forearm along y) and then leaned back by 10 degrees, which is where the axes 0 0.984808 0.173648 come from.
use <../../cad_library/servos.scad>
use <../../cad_library/shapes.scad>

part = "";
$fn = 28;

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
module base_foot() {
  hull() for (a = [45:90:315]) rotate(a) translate([58, 0]) circle(15);
}
module base_link() {
  difference() {
    union() {
      difference() {                                   // foot plate with four arms
        slab(7, 1) base_foot();
        for (a = [0:90:270]) rotate(a) translate([72, 0, -1]) linear_extrude(9) circle(31);
      }
      hull() {                                         // drum
        translate([0, 0, 6]) linear_extrude(1) circle(47);
        translate([0, 0, 36]) linear_extrude(1) circle(43);
      }
      translate([0, 0, 36]) cylinder(r1 = 43, r2 = 41, h = 5.8);
      hull() {                                         // electronics box behind
        translate([0, -52, 3]) linear_extrude(24) rounded([52, 30], 6);
        translate([0, -40, 3]) linear_extrude(31) rounded([46, 20], 5);
      }
    }
    translate([-10, 0, 3]) linear_extrude(60) square([41, 21], center = true);   // servo
    translate([-10, 0, 30]) linear_extrude(30) square([56, 21], center = true);  // its ears
    translate([24, 0, 8]) linear_extrude(60) rounded([16, 44], 5);               // cables
    translate([-10, -24, 8]) linear_extrude(60) rounded([40, 12], 4);
    translate([-10, 24, 8]) linear_extrude(60) rounded([40, 12], 4);
    translate([0, -72, 14]) rotate([-90, 0, 0]) linear_extrude(12) rounded([13, 7], 2);  // USB
    for (x = [-18:6:18]) translate([x, -50, 20]) linear_extrude(20) rounded([2.4, 16], 1.1, $fn = 8);  // vents
    for (a = [45:90:315]) rotate(a) translate([61, 0, -1]) {
      cylinder(d = 5, h = 10, $fn = 16);
      translate([0, 0, 5]) cylinder(d = 9.5, h = 10, $fn = 20);
    }
  }
}

// --- turret: turntable with two cheeks -----------------------------------------------------------------------------
module cheek_profile() {   // in y, z of the assembly
  difference() {
    filleted(6) {
      hull() {
        translate([0, shoulder.z]) circle(17);
        translate([-31, 51]) square([62, 2]);
      }
    }
    hull() { translate([-15, 59]) circle(3.5); translate([-9, 72]) circle(3); }
    hull() { translate([15, 59]) circle(3.5); translate([9, 72]) circle(3); }
    hull() { translate([0, 57]) circle(3.5); translate([0, 68]) circle(3); }
  }
}
module base_upper() {
  difference() {
    union() {
      translate([0, 0, turntable_z + 0.6]) slab(9.4, 1.2) circle(46);
      slab_y_free(-38, -30.63) cheek_profile();
      slab_y_free(21.5, 29) cheek_profile();
      translate([15.6, 0, shoulder.z]) rotate([0, 90, 0]) cylinder(d1 = 11, d2 = 16, h = 7);   // idler's journal
      translate([29, 0, shoulder.z]) rotate([0, 90, 0]) cylinder(d = 20, h = 2.2);            // bearing cap
      for (s = [-1, 1]) translate([0, s * 26, 52]) rotate([90, 0, 0])                          // gussets
        linear_extrude(5, center = true) polygon([[-33, 0], [-33, 15], [-22, 0], [16, 0], [24, 11], [24, 0]]);
    }
    translate([0, 0, turntable_z - 1]) cylinder(d = 24, h = 7.9);                              // horn of Revolute 1
    for (a = [45:90:315]) rotate(a) translate([7, 0, 40]) cylinder(d = 3.2, h = 20, $fn = 12);
    for (a = [20:40:340]) rotate(a) translate([38, 0, 49.5]) cylinder(d = 5, h = 5, $fn = 16);
    translate([-45, 0, shoulder.z]) rotate([0, 90, 0]) {
      cylinder(d = 9, h = 20, $fn = 20);
      for (a = [45:90:315]) rotate(a) translate([7, 0, 0]) cylinder(d = 3.2, h = 20, $fn = 12);
    }
  }
}
// A slab along x of a profile that need not be convex: the rims stay sharp.
module slab_y_free(x0, x1) { along_x(x0, x1) children(); }

// --- upper arm -------------------------------------------------------------------------------------------------------
module upper_arm_profile() {  // in y, z of the arm frame
  difference() {
    hull() {
      circle(22.5);
      translate([0, elbow_z]) circle(22);
    }
  }
}
module upper_arm_windows() {
  hull() { translate([-8, 52]) circle(4); translate([8, 52]) circle(4); translate([0, 63]) circle(3); }
  hull() { translate([-9, 75]) circle(4); translate([0, 66]) circle(2.5); translate([-9, 83]) circle(4); }
  hull() { translate([9, 75]) circle(4); translate([0, 66.5]) circle(2.5); translate([9, 83]) circle(4); }
  hull() { translate([-8, 100]) circle(4); translate([8, 100]) circle(4); translate([0, 90]) circle(3); }
}
module link_1() {
  difference() {
    union() {
      slab_x(-21, -13.8, 1.2) upper_arm_profile();       // plate that the servos' ears are screwed to
      slab_x(12.6, 19, 1.2) upper_arm_profile();         // plate on the bearings' side
      along_x(-14, 13) {                                   // webs between the plates
        translate([-15, 46]) square([30, 6]);
        translate([-15, 98]) square([30, 6]);
        translate([-2.5, 48]) square([5, 54]);
        intersection() {
          union() { translate([-23, -14]) square([46, 3.5]); translate([-23, elbow_z + 10.5]) square([46, 3.5]); }
          offset(delta = -3) upper_arm_profile();
        }
      }
    }
    along_x(-40, 40) upper_arm_windows();
    along_x(-40, -12) {                                    // openings for the two gear cases
      translate([-10.4, -10.4]) square([20.8, 41]);
      translate([-10.4, elbow_z - 30.6]) square([20.8, 41]);
    }
    along_x(10, 16) {                                     // pockets for the two bottoms
      translate([-10.4, -10.4]) square([20.8, 41]);
      translate([-10.4, elbow_z - 30.6]) square([20.8, 41]);
    }
    along_x(15, 40) for (z = [0, elbow_z]) translate([0, z]) circle(d = 11.4);
    along_x(-40, -10) for (z = [-14, 34.5, elbow_z - 34.5, elbow_z + 14], y = [-5, 5])
      translate([y, z]) circle(d = 3, $fn = 10);
  }
}

// --- elbow: a yoke that carries the forearm's servo ------------------------------------------------------------------
module yoke_cheek(r, back, front) {  // in y, z; round the axis at 0, reaching forward to `front`
  hull() {
    circle(r);
    translate([back, -13]) square([front - back, 26]);
  }
}
module link_2() {
  translate([0, 0, elbow_z]) difference() {
    union() {
      along_x(-37.5, -30.63) yoke_cheek(15, 26, 62);
      along_x(20.6, 27.4) yoke_cheek(15, 26, 62);
      translate([14, 0, 0]) rotate([0, 90, 0]) cylinder(d1 = 10, d2 = 15, h = 7);
      translate([27.4, 0, 0]) rotate([0, 90, 0]) cylinder(d = 18, h = 2);
      slab_y(26, 30.2, 1) translate([-5, 0]) square([65, 26], center = true);       // bridge
      slab_y(55, 62, 1) translate([-5, 0]) square([65, 30], center = true);         // frame in front of the ears
    }
    along_y(52, 66) translate([-10, 0]) square([41, 20.6], center = true);
    along_y(52, 66) for (x = [-34.5, 14.5], z = [-5, 5]) translate([x, z]) circle(d = 3, $fn = 10);
    along_y(20, 34) for (x = [-18, 0]) translate([x, 0]) rounded([12, 14], 4);
    along_x(-50, 50) hull() { translate([26, 0]) circle(5.5); translate([43, 0]) circle(5.5); }
    translate([-40, 0, 0]) rotate([0, 90, 0]) {
      cylinder(d = 9, h = 12, $fn = 20);
      for (a = [45:90:315]) rotate(a) translate([7, 0, 0]) cylinder(d = 3.2, h = 12, $fn = 12);
    }
  }
}

// --- forearm: turns about its own length, carries the wrist's servo ---------------------------------------------------
module link_3() {
  translate([0, roll_y, elbow_z]) difference() {
    union() {
      slab_y(0.2, 7, 1) circle(20);
      hull() {
        along_y(6, 7) circle(17);
        along_y(13, 14.5) translate([5, 0]) square([36, 28], center = true);
      }
      slab_x(-9, -4, 0.8) translate([39, 0]) rounded([57, 28], 6);     // plate behind the ears
      slab_x(17, 23, 0.8) translate([39, 0]) rounded([57, 28], 6);
      along_x(-5, 18) translate([13, -14]) square([4, 28]);
    }
    along_x(-16, 18) translate([20.8, -10.4]) square([42, 20.8]);
    along_x(-14, 30) translate([52, 0]) circle(d = 9);
    along_x(17, 30) hull() { translate([26, 0]) circle(5); translate([38, 0]) circle(5); }
    along_x(-14, 0) for (y = [17.5, 66.3], z = [-5, 5]) translate([y, z]) circle(d = 3, $fn = 10);
    along_y(-1, 12) { circle(d = 8); for (a = [0:90:270]) rotate(a) translate([7, 0]) circle(d = 3.2, $fn = 12); }
  }
}

// --- wrist: a yoke that carries the tool's servo ------------------------------------------------------------------------
module link_4() {
  translate([0, wrist_y, elbow_z]) difference() {
    union() {
      along_x(wrist_x - 6, wrist_x) yoke_cheek(13, 20, 56);
      along_x(25, 31) yoke_cheek(13, 20, 56);
      translate([19.5, 0, 0]) rotate([0, 90, 0]) cylinder(d1 = 8.6, d2 = 13, h = 6);
      translate([31, 0, 0]) rotate([0, 90, 0]) cylinder(d = 16, h = 1.8);
      slab_y(20, 24, 0.8) translate([-0.5, 0]) square([63, 26], center = true);
      slab_y(49, 55.4, 0.8) translate([-3.5, 0]) square([69, 26], center = true);
    }
    along_y(46, 60) translate([-10, 0]) square([41, 20.6], center = true);
    along_y(46, 60) for (x = [-34.5, 14.5], z = [-5, 5]) translate([x, z]) circle(d = 3, $fn = 10);
    along_y(18, 26) for (x = [-16, 0, 16]) translate([x, 0]) rounded([11, 14], 4);
    along_x(-50, 50) hull() { translate([22, 0]) circle(5); translate([40, 0]) circle(5); }
    translate([wrist_x - 8, 0, 0]) rotate([0, 90, 0]) {
      cylinder(d = 9, h = 10, $fn = 20);
      for (a = [45:90:315]) rotate(a) translate([7, 0, 0]) cylinder(d = 3.2, h = 10, $fn = 12);
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
    along_y(-1, 12) for (a = [0:90:270]) rotate(a) translate([7, 0]) circle(d = 3.2, $fn = 12);
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
      translate([0, -25.9, -2]) rotate([90, 0, 0]) slab(2.1, 0.5) rounded([34, 24], 6);
      for (s = [-1, 1]) translate([s * 13, -26, -5]) rotate([90, 0, 90])
        linear_extrude(3.4, center = true) polygon([[0, 0], [13, 0], [0, -8]]);
      translate([gear_x, 0, -0.6]) cylinder(d = 4.9, h = 8.4, $fn = 20);             // right gear's pin
      translate([gear_x, 0, -0.6]) cylinder(d = 8, h = 1, $fn = 24);
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
    hull() { translate([0, 6]) circle(7); translate([0, finger_y - gear_y]) circle(6); }
  }
}
module gear(side) {  // side -1: left, +1: right
  translate([side * gear_x, gear_y, elbow_z]) difference() {
    translate([0, 0, 0.6]) linear_extrude(6) gear_profile(side < 0 ? 0 : 9);
    translate([0, 0, -1]) cylinder(d = side < 0 ? 4.6 : 5.3, h = 10, $fn = 20);
    if (side < 0) cylinder(d = 12.6, h = 3.2);                                       // the servo's boss
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
    translate([0, 0, 6.7]) mirror([0, 0, 0]) union() {
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

module servo_of(joint) {  // where the shared meshes stand, for the assembly
  if (joint == 1) translate([0, 0, 49.5]) children();
  if (joint == 2) leaned() translate([shoulder.x, 0, 0]) rotate([0, -90, 0]) children();
  if (joint == 3) leaned() translate([shoulder.x, 0, elbow_z]) rotate([0, -90, 0]) rotate(180) children();
}

if (part == "base_link") base_link();
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
