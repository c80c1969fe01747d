"""rclpy.parameter, as far as nodes declare a parameter by its type."""
import enum


class Parameter:
    class Type(enum.Enum):
        STRING = 4
