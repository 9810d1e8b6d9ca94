"""With asyncio everything that waits is awaited, so that several sessions go on at once."""

import asyncio

import lpdeform
from shapes import grid

vertices, faces = grid(30, 6)


async def bend(height: float) -> float:
    async with lpdeform.open_async(vertices, faces) as session:
        session.set_handle("left", vertices[:, 0] == 0)
        session.set_handle("right", vertices[:, 0] == 30)
        return (await session.move("right", translation=[-6, 0, height])).energy


async def main() -> None:
    energies = await asyncio.gather(*(bend(height) for height in (5, 10, 15)))
    print("energies", [round(energy, 3) for energy in energies])


asyncio.run(main())
