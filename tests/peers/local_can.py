# SPDX-License-Identifier: MIT
"""The rig's local bus for python-can: frames over a Unix socket, as drivers/include/bevel/drivers/can/local_wire.hpp has them.

    bus = LocalBus("/tmp/bus")                          # a participant
    network = canopen.Network(); network.bus = bus      # or hand it to python-canopen
    hub = LocalHub("/tmp/bus")                          # passes on what others send, where no bevel-rig does

A packet is 16 bytes: identifier (4, little-endian), size, flags (1: echo of what the receiver sent), two zeros, data.
"""
import os
import select
import socket
import struct
import threading

import can

PACKET = struct.Struct("<IBB2x8s")
ECHO = 1


class LocalBus(can.BusABC):
    def __init__(self, channel, receive_own_messages=False, **kwargs):
        self.channel_info = f"local bus {channel}"
        self._echoes = receive_own_messages
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._socket.connect(channel)
        super().__init__(channel=channel, **kwargs)

    def _recv_internal(self, timeout):
        ready, _, _ = select.select([self._socket], [], [], timeout)
        if not ready:
            return None, False
        packet = self._socket.recv(PACKET.size)
        if not packet:
            raise can.CanOperationError(f"{self.channel_info}: the hub is gone")
        identifier, size, flags, data = PACKET.unpack(packet)
        if flags & ECHO and not self._echoes:
            return None, False
        return can.Message(arbitration_id=identifier, is_extended_id=False, data=data[:size]), False

    def send(self, msg, timeout=None):
        self._socket.send(PACKET.pack(msg.arbitration_id, msg.dlc, 0, bytes(msg.data).ljust(8, b"\0")))

    def fileno(self):
        return self._socket.fileno()

    def shutdown(self):
        super().shutdown()
        self._socket.close()


class LocalHub:
    """Every frame goes to all others, and back to its sender as an echo. Runs on a thread until close()."""

    def __init__(self, path):
        self._path = path
        self._listener = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._listener.bind(path)
        self._listener.listen(16)
        self._clients = []
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self):
        while not self._ended.is_set():
            ready, _, _ = select.select([self._listener, *self._clients], [], [], 0.05)
            for source in ready:
                if source is self._listener:
                    self._clients.append(source.accept()[0])
                else:
                    self._pass_on(source)

    def _pass_on(self, source):
        try:
            packet = source.recv(PACKET.size)
        except ConnectionError:
            packet = b""
        if len(packet) != PACKET.size:
            self._clients.remove(source)
            source.close()
            return
        identifier, size, _, data = PACKET.unpack(packet)
        for client in self._clients:
            try:
                client.send(PACKET.pack(identifier, size, ECHO if client is source else 0, data), socket.MSG_DONTWAIT)
            except OSError:
                pass  # one that does not read loses frames, as on a bus

    def close(self):
        self._ended.set()
        self._thread.join()
        for client in self._clients:
            client.close()
        self._listener.close()
        os.unlink(self._path)
