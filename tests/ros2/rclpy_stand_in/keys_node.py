"""A node that drives by keys like teleop_twist_keyboard, for machines without its source: each key is one message."""
import sys
import termios
import threading
import tty

import geometry_msgs.msg
import rclpy

MOTIONS = {"i": (1, 0), ",": (-1, 0), "j": (0, 1), "l": (0, -1)}


def main():
    before = termios.tcgetattr(sys.stdin)
    rclpy.init()
    node = rclpy.create_node("keys_node")
    stamped = node.declare_parameter("stamped", False).value
    kind = geometry_msgs.msg.TwistStamped if stamped else geometry_msgs.msg.Twist
    publisher = node.create_publisher(kind, "cmd_vel", 10)
    spinner = threading.Thread(target=rclpy.spin, args=(node,))
    spinner.start()
    speed = 0.5
    tty.setraw(sys.stdin.fileno())
    print("currently:", speed, flush=True)
    key = ""
    while key != "\x03":
        key = sys.stdin.read(1)
        speed *= 1.1 if key == "q" else 1
        linear, angular = MOTIONS.get(key, (0, 0))
        message = kind()
        twist = message.twist if stamped else message
        if stamped:
            message.header.stamp = node.get_clock().now().to_msg()
        twist.linear.x, twist.angular.z = linear * speed, float(angular)
        publisher.publish(message)
    rclpy.shutdown()
    spinner.join()
    termios.tcsetattr(sys.stdin, termios.TCSADRAIN, before)


main()
