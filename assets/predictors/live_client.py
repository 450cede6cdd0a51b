"""Sends 200 poses to `musicworld predict --source osc:9000 --send osc:9001 ...`, 100 a second, and prints what it
expects: python3 live_client.py 9000 9001 200"""
import math, socket, struct, sys, time

def string(data, at):  # and what is behind it: zeros fill it up to a multiple of four bytes
    end = data.index(0, at)
    return data[at:end].decode(), end // 4 * 4 + 4

to, back, count = (int(word) for word in sys.argv[1:4])
link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
link.bind(("127.0.0.1", back))
link.settimeout(0.2)
for t in (i / 100 for i in range(count)):
    pose = struct.pack(">8s8sdfff", b"/left", b",dfff", t, 0, 1 + 0.2 * math.sin(8 * t), 0)
    link.sendto(pose, ("127.0.0.1", to))
    time.sleep(0.01)
    try:
        bundle, at = link.recv(4096), 16  # behind "#bundle" and its time
    except socket.timeout:  # the first pose has no answer
        continue
    while at < len(bundle):
        address, types_at = string(bundle, at + 4)
        types, i = string(bundle, types_at)
        numbers = ">" + types[1:].rstrip("s")  # an instrument's name comes last
        values = struct.unpack_from(numbers, bundle, i)
        print(address, *values, *([string(bundle, i + struct.calcsize(numbers))[0]] if "s" in types else []))
        if len(values) == 17:  # with yy of the covariance, and radius_50
            print("the 50 % region reaches", (values[12] * values[15]) ** 0.5, "m up and down")
        at += 4 + int.from_bytes(bundle[at:at + 4], "big")
