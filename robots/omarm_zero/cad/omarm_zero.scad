// OmArm Zero, printed parts. Millimetres, base_link's frame: z up, in the pose in which every joint is at zero (upper arm
// and forearm level along x, hand upright). `part` picks what is built; robots/build_meshes asks for each in turn.
//
// The shoulder was assembled 0.94 degrees askew, so everything above the turntable is drawn straight in the "arm frame"
// (origin on the shoulder axis) and then turned: that is the axis 0.016327 0.999867 0 of Revolute 2.
use <../../cad_library/servos.scad>
use <../../cad_library/shapes.scad>

part = "";
$fn = 20;

turntable_z = 50.87;   // Revolute 1
shoulder_z = 97.87;    // 2
askew = -0.93552;
elbow_x = 105;         // 3
wrist_x = 190;         // 4
roll_z = 49;           // above the wrist: 5
gear_z = 69;           // 6 and 7
gear_x = 9;
horn_y = -24;          // outer faces of the big servos' horns

module arm() { translate([0, 0, shoulder_z]) rotate(askew) children(); }
module hand() { translate([wrist_x, 0, 0]) children(); }

// --- base: drum over the turning servo, electronics in front ---------------------------------------------------------
module base_link() {
  difference() {
    union() {
      slab(5, 0.8) hull() {
        for (x = [-38, 38]) { translate([x, -34]) circle(12); translate([x * 0.86, 84]) circle(12); }
      }
      hull() {
        translate([0, 0, 4]) linear_extrude(1) circle(45, $fn = 28);
        translate([0, 0, 44]) linear_extrude(1) circle(41, $fn = 28);
      }
      translate([0, 0, 44]) cylinder(r1 = 41, r2 = 39, h = 6.3, $fn = 28);
      hull() {
        translate([0, 62, 4]) linear_extrude(20) rounded([68, 48], 8, $fn = 12);
        translate([0, 56, 4]) linear_extrude(28) rounded([58, 34], 7, $fn = 12);
      }
    }
    translate([-10, 0, 10.5]) linear_extrude(60) square([41, 21], center = true);
    translate([-10, 0, 37]) linear_extrude(30) square([56, 21], center = true);
    translate([23, 0, 6]) linear_extrude(60) rounded([13, 38], 4, $fn = 4);
    for (s = [-1, 1]) translate([-6, 22 * s, 6]) linear_extrude(60) rounded([38, 13], 4, $fn = 4);
    translate([0, 62, 6]) linear_extrude(15) rounded([56, 36], 4, $fn = 4);                          // room for the boards
    translate([0, 90, 11]) rotate([90, 0, 0]) linear_extrude(12) rounded([12, 6], 2, $fn = 8);  // USB
    for (x = [-18:9:18]) translate([x, 60, 20]) linear_extrude(20) square([3, 20], center = true);
    for (x = [-38, 38]) { translate([x, -34, -1]) cylinder(d = 4.5, h = 9, $fn = 8); translate([x * 1.05, 87, -1]) cylinder(d = 4.5, h = 9, $fn = 8); }
  }
}

// --- turret: holds the shoulder's servo upright ------------------------------------------------------------------------
module turret_profile() {  // in x, z of the arm frame
  hull() { circle(16); translate([-25, -39.5]) square([50, 1]); }
}
module base_upper() {
  difference() {
    union() {
      translate([0, 0, turntable_z + 0.5 - shoulder_z]) slab(7.5, 1) circle(39, $fn = 40);
      along_y(-7, 23) turret_profile();
      translate([0, 23, 0]) rotate([-90, 0, 0]) cylinder(d1 = 14, d2 = 9, h = 7.5);  // idler's journal
    }
    along_y(-30, 18.5) translate([-10.3, -38.6]) square([20.6, 49.1]);               // servo
    along_y(-30, -6.9) translate([-10.3, -38.6]) square([20.6, 56]);
    along_y(-30, 40) for (s = [-1, 1]) hull() { translate([15.5 * s, -32]) circle(2.6); translate([13.6 * s, -14]) circle(1.6); }
    along_y(15, 24) for (z = [-28, -16]) translate([0, z]) rounded([12, 8], 3);
    translate([0, 0, turntable_z - 1 - shoulder_z]) cylinder(d = 22, h = 6.6);
    for (a = [30:60:330]) rotate(a) translate([33.5, 0, -43]) cylinder(d = 4.4, h = 6, $fn = 8);
  }
}

// --- upper arm: two cheeks and a box between them -------------------------------------------------------------------------
module upper_arm_profile() {
  difference() {
    filleted(14) {
      circle(16);
      translate([elbow_x, 0]) circle(16);
      translate([0, -10.5]) square([elbow_x, 21]);
    }
    for (x = [27, 78]) hull() { translate([x - 6, 0]) circle(4.6, $fn = 12); translate([x + 6, 0]) circle(4.6, $fn = 12); }
    translate([52.5, 0]) circle(5, $fn = 12);
  }
}
module arm_link_1() {
  difference() {
    union() {
      along_y(horn_y - 6, horn_y) upper_arm_profile();
      along_y(25, 31) upper_arm_profile();
      along_y(31, 32.6) for (x = [0, elbow_x]) translate([x, 0]) circle(10);
      along_y(horn_y - 1, 26) for (x = [40, 61]) translate([x, -9]) square([4, 18]);
      along_y(horn_y - 1, 26) translate([40, -9]) square([25, 3]);
      hull() for (x = [42, 63]) translate([x, 0, 0]) along_y(-1, 2) translate([-2, -9]) square([4, 18]);
    }
    along_y(24, 40) for (x = [0, elbow_x]) translate([x, 0]) circle(d = 9.4);
    along_y(-40, horn_y + 1) for (x = [0, elbow_x]) translate([x, 0]) {
      circle(d = 8);
      for (a = [45:90:315]) rotate(a) translate([7, 0]) circle(d = 2.8, $fn = 5);
    }
  }
}

// --- forearm: the elbow's servo at one end, the wrist's at the other -------------------------------------------------------
module arm_link_2() {
  w = wrist_x - elbow_x;
  translate([elbow_x, 0, 0]) difference() {
    union() {
      along_y(-7, 23) hull() { circle(15); translate([30, -13]) square([10, 26]); }
      hull() {
        along_y(-7, 21) translate([37, -13]) square([1, 26]);
        along_y(-1.8, 14.6) translate([61, -8.5]) square([1, 17]);
      }
      along_y(-1.8, 14.6) hull() { translate([60, -8.5]) square([26, 17]); translate([w, 0]) circle(8.5); translate([w + 10, -4]) square([2, 8]); }
      translate([0, 23, 0]) rotate([-90, 0, 0]) cylinder(d1 = 14, d2 = 9, h = 7.5);
      translate([w, 14.6, 0]) rotate([-90, 0, 0]) cylinder(d1 = 9, d2 = 6, h = 4.4);
    }
    along_y(-30, 18.5) translate([-10.5, -10.3]) square([41, 20.6]);                        // elbow's servo
    along_y(-30, -6.9) translate([-18, -10.3]) square([56, 20.6]);
    along_y(-30, 10.8) translate([w - 17.2, -6.3]) square([23.2, 12.6]);                    // wrist's servo
    along_y(-30, 30) hull() { translate([43, 0]) circle(6); translate([56, 0]) circle(4); }  // lightening
    along_y(15, 25) translate([12, 0]) rounded([20, 12], 4);
  }
}

// --- wrist: a yoke with the rolling servo on top ---------------------------------------------------------------------------
module arm_link_3() {
  hand() difference() {
    union() {
      along_y(-19, -15) wrist_cheek();
      along_y(15.4, 19.4) wrist_cheek();
      translate([0, 0.2, 17]) slab(3, 0.6) rounded([19, 38], 3);
      translate([0, -3, 31]) slab(4.8, 0.6) rounded([17, 46], 3);
      along_y(19.4, 20.6) circle(6.5);
    }
    translate([0, -5.5, 30]) linear_extrude(10) square([12.6, 23.2], center = true);
    translate([0, -5.5, 30]) for (s = [-1, 1]) translate([0, 14 * s, 0]) cylinder(d = 1.8, h = 10, $fn = 5);
    along_y(15, 22) circle(d = 6.4);
    along_y(-22, -14) { circle(d = 5); for (z = [7]) translate([0, z]) circle(d = 1.8, $fn = 8); }
    along_y(-25, 25) hull() { translate([0, 22.5]) circle(2.4); translate([0, 28]) circle(2.4); }
  }
}
module wrist_cheek() { hull() { circle(8.5); translate([-8.5, 16]) square([17, 19.8]); } }

// --- gripper -----------------------------------------------------------------------------------------------------------------
module gripper_base() {
  hand() difference() {
    union() {
      translate([0, 0, roll_z + 0.2]) slab(3.2, 0.5) circle(11);
      along_y(-2.4, 2.2) hull() { translate([-11, roll_z + 2]) square([22, 1]); for (s = [-1, 1]) translate([gear_x * s, gear_z]) circle(8.5); }
      along_y(-10, 8) difference() { translate([-1.8, roll_z + 3]) square([3.6, 5]); translate([-3, roll_z + 14]) circle(6); }
      along_y(2, 8.6) translate([gear_x, gear_z]) circle(d = 3.9);
      along_y(2, 2.9) translate([gear_x, gear_z]) circle(d = 7);
    }
    along_y(-5, 5) translate([-gear_x - 6.3, gear_z - 17.2]) square([12.6, 23.2]);
    along_y(-5, 5) for (s = [-1, 1]) translate([-gear_x, gear_z - 5.5 + 14 * s]) circle(d = 1.8, $fn = 8);
    along_y(-5, 5) translate([gear_x, gear_z - 11]) rounded([7, 6], 2);
    translate([0, 0, roll_z - 1]) cylinder(d = 5, h = 6);
  }
}
module finger_profile(side) {  // from the gear's axis; z upwards; the other finger towards -side
  inner = -side * (gear_x - 1.4);
  difference() {
    union() {
      circle(7.6);
      for (i = [0:14]) rotate(24 * i + (side < 0 ? 0 : 12)) polygon([[6.6, -1.7], [9.7, -0.6], [9.7, 0.6], [6.6, 1.7]]);
      hull() { translate([side * 1, 4]) circle(5.5); translate([side * 5, 20]) circle(4.5); }
      hull() { translate([side * 5, 20]) circle(4.5); translate([inner + side * 2.4, 44]) circle(1.8); translate([inner + side * 0.3, 24]) square(0.1); }
      hull() { translate([inner + (side < 0 ? -2 : 0), 24]) square([2, 20]); translate([inner + side * 2.4, 44]) circle(1.8); }
    }
    for (z = [27:3.6:43]) translate([inner, z]) rotate(45) square(1.5, center = true);
    translate([side * 4.4, 19]) circle(2);
  }
}
module finger(side) {
  hand() translate([side * gear_x, 0, gear_z]) difference() {
    union() {
      along_y(3, 8) finger_profile(side);
      along_y(-1, 12) intersection() { finger_profile(side); translate([-20, 24.5]) square([40, 40]); }
    }
    along_y(2, side < 0 ? 5.4 : 2) circle(d = side < 0 ? 7.2 : 0.1);
    along_y(0, 10) circle(d = side < 0 ? 2.4 : 4.2, $fn = 14);
  }
}

if (part == "base_link") base_link();
if (part == "base_link_upper_1") arm() base_upper();
if (part == "arm_link_1_1") arm() arm_link_1();
if (part == "arm_link_2_1") arm() arm_link_2();
if (part == "arm_link_3_1") arm() arm_link_3();
if (part == "gripper_base_1") arm() gripper_base();
if (part == "gripper_left_1") arm() finger(-1);
if (part == "gripper_right_1") arm() finger(1);
if (part == "mg996r_body") ds3240_body();
if (part == "mg996r_horn") ds3240_horn();
if (part == "mg90s_body") sg90_body();
