"""At the machine: readings from instruments, the twin that simulates both, and LinuxCNC without a screen."""

from stepdiag.acquisition.acquire import acquire
from stepdiag.acquisition.options import AcquireOptions
from stepdiag.acquisition.settle_trigger import SettleTrigger
from stepdiag.acquisition.settling import Settling
from stepdiag.acquisition.tcp_trigger import TcpTrigger
from stepdiag.acquisition.triggers import KeyTrigger
from stepdiag.linuxcnc.processes import LinuxcncError
from stepdiag.linuxcnc.session import LinuxcncSession
from stepdiag.twin.server import Twin

__all__ = [
    "AcquireOptions",
    "KeyTrigger",
    "LinuxcncError",
    "LinuxcncSession",
    "SettleTrigger",
    "Settling",
    "TcpTrigger",
    "Twin",
    "acquire",
]


def __dir__() -> list[str]:
    return __all__
