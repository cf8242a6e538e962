"""A pseudo-terminal as a serial device holds it."""

import errno
import fcntl
import os
import struct
import termios
import tty


class Terminal:
    """A pseudo-terminal of which this side is the device."""

    def __init__(self, unread_bytes=None):
        self.unread_bytes = unread_bytes
        self.master, self.slave = os.openpty()
        tty.setraw(self.slave)
        os.set_blocking(self.master, False)
        self.name = os.ttyname(self.slave)
        self.lost_bytes = 0

    def write(self, data):
        """Sends to the host; what nobody reads is dropped."""
        if self.is_closed():
            return
        if self.unread_bytes is not None:
            unread = struct.unpack("i", fcntl.ioctl(self.slave, termios.FIONREAD, bytes(4)))[0]
            if unread > self.unread_bytes:
                termios.tcflush(self.slave, termios.TCIFLUSH)
        try:
            written = os.write(self.master, data)
        except BlockingIOError:
            written = 0
        self.lost_bytes += len(data) - written

    def read(self):
        """Returns what the host has sent."""
        try:
            return os.read(self.master, 65536)
        except OSError as error:
            if error.errno in (errno.EAGAIN, errno.EIO):
                return b""
            raise

    def is_closed(self):
        """Returns whether the cable is pulled."""
        return self.master is None

    def close(self):
        """Closes both ends, as a cable that is pulled does."""
        if not self.is_closed():
            os.close(self.master)
            os.close(self.slave)
            self.master = None
